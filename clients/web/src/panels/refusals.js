// Shows refusals of sonard beside the control that caused the request, in whichever panel or tab it is.
import { $, setHidden, setText } from '../dom.js';

const lasts_ms = 10000;
const gap_px = 6;
const rows = '.setting, #troubles > button, .row, .panel > header';

export class Refusals {
  constructor() {
    this.box = $('refusal');
    this.asked = new Map();  // id of a request -> the row of its control, and the place of the control
    for (const kind of ['pointerdown', 'keydown', 'click'])
      document.addEventListener(kind, (event) => {
        this.touched = event.target;
        // Pointerdown must not hide the refusal: the controls below would move away from the pointer before the click.
        if (kind === 'click' || event.key === 'Escape') this.hide();
      }, true);
  }

  hide() {
    clearTimeout(this.timer);
    setHidden(this.box, true);
  }

  /// Remembers the place of the control that was touched last, which caused request `id`.
  note(id) {
    this.hide();  // hides the refusal of an earlier request
    const control = this.touched?.closest?.('button, input, select') ?? document.activeElement;
    this.asked.set(id, { row: control.closest(rows), place: control.getBoundingClientRect() });
  }

  /// Shows the text below the control's row, which makes room for it, or beside the control. The parameter's name in front is left
  /// out, because the place shows that.
  show(id, text, name = '') {
    const { box } = this;
    const { row, place = { left: 0, top: innerHeight / 2, bottom: innerHeight / 2 } } = this.asked.get(id) ?? {};
    const inRow = Boolean(row?.isConnected && row.offsetWidth);
    box.classList.toggle('in-row', inRow);
    if (inRow) row.after(box);
    else document.body.append(box);
    setText(box, text.startsWith(`${name}: `) ? text.slice(name.length + 2) : text);
    setHidden(box, false);
    const below = place.bottom + gap_px + box.offsetHeight < innerHeight;
    box.style.left = `${Math.max(gap_px, Math.min(place.left, innerWidth - box.offsetWidth - gap_px))}px`;
    box.style.top = `${below ? place.bottom + gap_px : Math.max(gap_px, place.top - gap_px - box.offsetHeight)}px`;
    if (inRow) box.scrollIntoView({ block: 'nearest' });
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.hide(), lasts_ms);
  }
}
