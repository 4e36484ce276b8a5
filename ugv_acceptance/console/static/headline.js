// The header: the state in a word, what is wrong and by how much, and largest of all what to do.
import { $, text, element, fixed } from './dom.js';

// A shape of its own for each level; colours are in the style sheet.
const SIGNS = {
  OK: ['M50 4a46 46 0 1 0 .01 0z', '✓'],
  WARN: ['M50 6 98 92H2z', '!'],
  ERROR: ['M31 4h38l27 27v38l-27 27H31L4 69V31z', '!'],
  STALE: ['M8 8h84v84H8z', '?'],
};
const NOTHING = { what: '', number: '', action: '', detail: '', cause: '', notes: [], more: 0 };
let spoken = '';

export function showHeadline(shown) {
  const level = shown.level, line = { ...NOTHING, ...shown.headline };
  document.body.dataset.level = level;
  // The map of where the arm may go is of a robot that stands.
  document.body.toggleAttribute('data-fallen', line.action === 'STAND CLEAR');
  sign(level);
  text($('word'), shown.word);
  const what = line.what === shown.word ? '' : line.what;
  text($('what'), what && line.number ? `${what},` : what);
  text($('number'), line.number.replace('<=', '≤'));
  text($('action'), line.action);
  text($('detail'), line.detail);
  list($('notes'), line.notes);
  text($('cause'), `${line.cause} ${line.more ? `(and ${line.more} more)` : ''}`.trim());
  $('verdict').classList.toggle('flash', shown.cards.some((card) => card.unseen && card.level === 'ERROR'));
  // Numbers change all the time; a screen reader is told when the kind of trouble does.
  const kind = `${shown.word} ${what}`;
  if (kind === spoken) return;
  spoken = kind;
  text($('spoken'), [shown.word, what, line.action, line.detail, line.cause].filter(Boolean).join('. '));
}

function sign(level) {
  const [shape, glyph] = SIGNS[level];
  if ($('sign-shape').getAttribute('d') !== shape) $('sign-shape').setAttribute('d', shape);
  text($('sign-glyph'), glyph);
}

function list(box, lines) {
  while (box.children.length > lines.length) box.lastChild.remove();
  lines.forEach((line, k) => text(box.children[k] ?? box.appendChild(element('li')), line));
}

// Seconds to the limit. The monitor says them anew each second: between two words of a live robot they count down here.
export class Countdown {
  constructor() {
    this.said = null;
    this.since = 0;
  }

  show(shown, live) {
    const now = performance.now(), said = shown.seconds ?? null;
    if (said !== this.said) { this.said = said; this.since = now; }
    $('countdown').hidden = said === null;
    if (said === null) return;
    text($('seconds'), fixed(Math.max(0, said - (live ? (now - this.since) / 1000 : 0))));
    text($('seconds-to'), shown.seconds_to);
  }
}

// What the page itself says where nothing comes from the server: the words of any other NO DATA. Who has fallen stays so.
export function lost({ frame, known, knownAt }, age) {
  const said = known?.headline, seconds = fixed((performance.now() - knownAt) / 1000);
  const order = said?.action === 'STAND CLEAR' ? said : { what: 'NO DATA', action: 'STOP', detail: 'do not move on these numbers' };
  return {
    level: 'STALE',
    word: 'NO DATA',
    headline: {
      what: order.what,
      action: order.action,
      detail: order.detail,
      notes: said ? [`last known ${seconds} s ago: ${said.margins || said.notes[0] || said.what}`] : [],
      cause: Number.isFinite(age)
        ? `the console server has sent nothing for ${fixed(age / 1000)} s: check that it runs and that the network is there`
        : 'no answer from the console server',
    },
    seconds: null,
    cards: (frame?.cards ?? []).map((card) => ({ ...card, advice: '' })),
    past: frame?.past ?? [],
  };
}
