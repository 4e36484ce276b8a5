// One card a cause. A card keeps its place in the document, so that a finger or the focus stays on its button.
import { $, text, element, fixed, say } from './dom.js';
import { who } from './tell.js';

const DEEDS = { acknowledge: 'Acknowledge', shelve: 'Shelve 5 min', unshelve: 'Unshelve', reset: 'Reset' };
const MOST = 8;
const SHELVED = 300; // s

export class Alerts {
  constructor(ask) {
    this.ask = ask;
    this.lists = [new Cards($('alerts'), this), new Cards($('past-alerts'), this)];
    $('acknowledge-all').addEventListener('click', () => this.send('acknowledge', {}));
  }

  describe(hello) {
    this.live = hello.source === 'live';
  }

  send(deed, about) {
    this.ask({ do: deed, ...about, ...who(), for_s: SHELVED }, say('answer'));
  }

  show({ cards, past }) {
    this.lists[0].show(cards, this.live);
    this.lists[1].show(past, this.live);
    const hidden = cards.length - MOST;
    $('no-alerts').hidden = cards.length > 0;
    text($('alert-count'), cards.length ? `(${cards.length}${hidden > 0 ? `, +${hidden} more` : ''})` : '');
    const unseen = past.filter((card) => card.unseen).length, held = past.filter((card) => card.offers.includes('reset')).length;
    const open = [unseen && `${unseen} not acknowledged`, held && `${held} to reset`].filter(Boolean);
    $('past').hidden = !past.length;
    text($('past-count'), `Past alerts (${[past.length, ...open].join(', ')})`);
    $('acknowledge-all').hidden = !this.live || !(cards.length || past.length);
    $('acknowledge-all').disabled = !unseen && !cards.some((card) => card.unseen);
  }
}

class Cards {
  constructor(list, alerts) {
    this.list = list;
    this.alerts = alerts;
    this.cards = new Map();
  }

  show(all, live) {
    const shown = all.slice(0, MOST), keys = new Set(shown.map((card) => card.key));
    for (const [key, node] of this.cards) if (!keys.has(key)) { node.remove(); this.cards.delete(key); }
    shown.forEach((card, place) => {
      const node = this.cards.get(card.key) ?? this.make(card.key);
      this.fill(node, card, live);
      if (this.list.children[place] !== node) this.list.insertBefore(node, this.list.children[place] ?? null);
    });
  }

  make(key) {
    const node = element('li', 'card');
    node.append(element('strong', 'tag'), element('strong', 'what'), element('div', 'words'), element('div', 'worst'), element('div', 'do'),
      element('div', 'parts'), element('small'), element('div', 'buttons'));
    node.dataset.key = key;
    this.cards.set(key, node);
    return node;
  }

  fill(node, card, live) {
    const [tag, what, words, worst, todo, parts, small, buttons] = node.children;
    node.className = `card ${card.level} ${card.active ? 'active' : 'over'} ${card.unseen ? 'unacknowledged' : ''}`;
    node.dataset.state = card.state;
    text(tag, card.word);
    text(what, card.title);
    text(words, card.text);
    text(worst, card.worst ? `worst: ${card.worst}` : '');
    text(todo, card.advice);
    text(parts, (card.parts ?? []).join('; '));
    text(small, `${card.state}, ${fixed(card.age_s, 0)} s ago, ${card.code} ${card.subject}${card.note ? `, by ${card.note}` : ''}`);
    const offers = live ? card.offers : [], wanted = offers.join(' ');
    node.keys = card.keys;
    if (buttons.dataset.offers === wanted) return;
    buttons.dataset.offers = wanted;
    buttons.replaceChildren(...offers.map((deed) => {
      const button = element('button', '', DEEDS[deed] ?? deed);
      button.type = 'button';
      button.dataset.deed = deed;
      button.addEventListener('click', () => this.alerts.send(deed, { key: card.key, keys: node.keys }));
      return button;
    }));
  }
}
