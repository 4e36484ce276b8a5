// The list of alerts; an alert keeps its place in the document, so that a finger or the focus stays on its button.
import { $, text, element, fixed, say } from './dom.js';

const DEEDS = { acknowledge: 'Acknowledge', shelve: 'Shelve 5 min', unshelve: 'Unshelve', reset: 'Reset' };
const MOST = 8;

export class Alerts {
  constructor(ask) {
    this.ask = ask;
    this.rows = new Map();
    $('acknowledge-all').addEventListener('click', () => this.send('acknowledge', null));
  }

  describe(hello) {
    this.live = hello.source === 'live';
  }

  send(deed, key) {
    this.ask({ do: deed, key, by: $('operator').value, note: $('note').value, for_s: 300 }, say('alert-answer'));
  }

  show(frame) {
    const list = $('alerts'), shown = frame.alerts.slice(0, MOST), hidden = frame.alerts.length - shown.length;
    const keys = new Set(shown.map((a) => a.key));
    for (const [key, row] of this.rows) if (!keys.has(key)) { row.remove(); this.rows.delete(key); }
    shown.forEach((alert, place) => {
      const row = this.rows.get(alert.key) ?? this.make(alert);
      this.fill(row, alert);
      if (list.children[place] !== row) list.insertBefore(row, list.children[place] ?? null);
    });
    $('no-alerts').hidden = frame.alerts.length > 0;
    text($('alert-count'), frame.alerts.length ? `(${frame.alerts.length}${hidden > 0 ? `, +${hidden} more` : ''})` : '');
    const open = frame.alerts.some((a) => a.unseen);
    $('acknowledge-all').disabled = !open;
    $('acknowledge-all').hidden = !this.live || !frame.alerts.length;
    $('who').hidden = !this.live || (!frame.alerts.length && !$('who').contains(document.activeElement));
  }

  make(alert) {
    const row = element('li');
    row.append(element('strong', 'tag'), element('span', 'what'), element('div', 'do'), element('small'), element('div', 'buttons'));
    row.dataset.key = alert.key;
    this.rows.set(alert.key, row);
    return row;
  }

  fill(row, alert) {
    const [tag, what, todo, small, buttons] = row.children;
    row.className = `${alert.level} ${alert.active ? 'active' : 'over'} ${alert.unseen ? 'unacknowledged' : ''}`;
    row.dataset.state = alert.state;
    text(tag, alert.word);
    text(what, alert.text);
    // What is over asks for its button alone.
    text(todo, alert.active ? alert.advice : '');
    text(small, `${alert.state}, ${fixed(alert.age_s, 0)} s ago, ${alert.code} ${alert.subject}${alert.note ? `, by ${alert.note}` : ''}`);
    const wanted = alert.offers.join(' ');
    if (buttons.dataset.offers !== wanted) {
      buttons.dataset.offers = wanted;
      buttons.replaceChildren(...alert.offers.map((deed) => {
        const button = element('button', '', DEEDS[deed] ?? deed);
        button.type = 'button';
        button.dataset.deed = deed;
        button.addEventListener('click', () => this.send(deed, alert.key));
        return button;
      }));
    }
  }
}
