// Shows refusals of sonard beside the control that caused the request, in whichever panel or tab it is.
import { $, setHidden, setText } from '../dom.js';

const lasts_ms = 10000;
const gap_px = 6;

export class Refusals {
  constructor() {
    this.asked = new Map();  // id of a request -> where its control was
    for (const kind of ['pointerdown', 'keydown'])
      document.addEventListener(kind, (event) => {
        this.touched = event.target;
        if (kind === 'pointerdown' || event.key === 'Escape') this.hide();
      }, true);
  }

  hide() {
    clearTimeout(this.timer);
    setHidden($('refusal'), true);
  }

  /// Remembers the place of the control that was touched last, which caused request `id`.
  note(id) {
    const control = this.touched?.closest?.('button, input, select') ?? document.activeElement;
    this.asked.set(id, control.getBoundingClientRect());
  }

  /// Shows the text beside the control, without the parameter's name in front, because the place shows that.
  show(id, text, name = '') {
    const box = $('refusal');
    const at = this.asked.get(id);
    setText(box, text.startsWith(`${name}: `) ? text.slice(name.length + 2) : text);
    setHidden(box, false);
    const place = at ?? { left: 0, top: innerHeight / 2, bottom: innerHeight / 2 };
    const below = place.bottom + gap_px + box.offsetHeight < innerHeight;
    box.style.left = `${Math.max(gap_px, Math.min(place.left, innerWidth - box.offsetWidth - gap_px))}px`;
    box.style.top = `${below ? place.bottom + gap_px : Math.max(gap_px, place.top - gap_px - box.offsetHeight)}px`;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.hide(), lasts_ms);
  }
}
