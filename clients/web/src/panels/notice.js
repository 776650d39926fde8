// Shows the sentence over the fan, its button, and the badges beside the ping's number.
import { $, make, setHidden, setText, showList, sign } from '../dom.js';
import { badgesOf, situationOf } from '../situation.js';

export class Notice {
  constructor(facts, connection, steering) {
    Object.assign(this, { facts, connection, steering });
    $('notice-button').addEventListener('click', () => this.act());
    $('token-form').addEventListener('submit', (event) => {
      event.preventDefault();
      connection.useToken($('token').value.trim());
    });
  }

  act() {
    const button = this.now?.button;
    if (button?.parameter) this.steering.set(button.parameter, button.value);
    else if (button) this.steering.call(button.service, button.request);
  }

  /// Shows the situation; hides the notice if there is none.
  draw() {
    const { facts } = this;
    const now = (this.now = situationOf(facts, this.connection));
    document.body.dataset.situation = now?.kind ?? 'fine';
    setHidden($('notice'), !now);
    setText($('notice-text'), now?.text ?? '');
    setHidden($('token-form'), now?.kind !== 'token');
    const button = $('notice-button');
    setHidden(button, !now?.button);
    setText(button, now?.button?.label ?? '');
    button.disabled = !facts.maySteer;
    button.title = facts.maySteer ? '' : 'this page is read-only';
    const badges = badgesOf(facts);
    showList($('badges'), badges, () => badges.map((b) => make('span', { class: `chip ${b.level}`, title: b.title }, b.level === 'warning' ? sign('warning') : null, b.text)));
    return now;
  }
}
