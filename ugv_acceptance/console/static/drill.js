// A drill: the situation, the question, the answers as buttons (also by keys), what came of it. Elsewhere it is not there.
import { $, text, element, fixed, say } from './dom.js';

const MOST_KEYS = 9;
const TYPES_TEXT = 'input, select, textarea';

export class Drill {
  constructor(ask) {
    this.ask = ask;
    this.drill = null;
    this.listed = '';
    this.phase = '';
    $('drill-next').addEventListener('click', () => this.tell({ do: 'next' }));
    $('drill-repeat').addEventListener('click', () => this.tell({ do: 'repeat' }));
    document.addEventListener('keydown', (event) => this.press(event));
  }

  tell(words) {
    this.ask(words, (answer) => answer.ok || say('drill-answer')(answer));
  }

  // 1 to 9 give that answer; what is typed into a field is no answer.
  press(event) {
    if (this.phase !== 'ask' || event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.target instanceof Element && event.target.matches(TYPES_TEXT)) return;
    const button = /^[1-9]$/.test(event.key) ? $('drill-choices').children[Number(event.key) - 1]?.firstChild : null;
    if (button && !button.disabled) button.click();
  }

  show(frame) {
    const drill = frame.drill ?? null;
    $('drill').hidden = !drill;
    if (!drill) return;
    this.drill = drill;
    const { phase } = drill, asks = phase === 'ask', judged = phase === 'judged', ended = phase === 'ended';
    text($('drill-number'), ended ? 'The drill is over' : `Drill ${drill.number} of ${drill.of}`);
    text($('drill-title'), ended ? '' : drill.title);
    text($('drill-story'), ended ? '' : drill.story);
    text($('drill-question'), asks ? drill.question : phase === 'watch' ? 'Watch the robot. You will be asked.' : '');
    $('drill-left').hidden = !asks || drill.left_s === null;
    text($('drill-seconds'), drill.left_s === null ? '' : String(Math.ceil(drill.left_s)));
    this.list(asks ? drill.choices : []);
    for (const row of $('drill-choices').children) {
      const done = row.dataset.key === drill.answer;
      row.firstChild.disabled = done;
      row.firstChild.setAttribute('aria-pressed', String(done));
    }
    const chosen = drill.choices?.find((choice) => choice.key === drill.answer);
    text($('drill-chosen'), phase === 'acting' || judged ? `You: ${chosen ? chosen.words : 'no answer'}` : '');
    $('drill-outcome').className = drill.passed === true ? 'passed' : 'repeat';
    $('drill-outcome').hidden = !judged;
    text($('drill-passed'), judged ? (drill.passed ? '✓ PASSED' : '✗ TO REPEAT') : '');
    text($('drill-happened'), judged ? drill.happened : '');
    text($('drill-lesson'), judged ? drill.lesson : '');
    $('drill-next').hidden = $('drill-repeat').hidden = !judged;
    text($('drill-next'), drill.number === drill.of ? 'Finish' : 'Next situation');
    this.summary(ended ? drill : null);
    if (phase !== this.phase) this.turn(phase);
  }

  // In a new phase what counts comes into sight, and the focus to the button that goes on.
  turn(phase) {
    const first = this.phase === '', focused = document.activeElement;
    this.phase = phase;
    $('drill').dataset.phase = phase;
    if (!first) this.look(phase);
    if (phase === 'judged' && (focused === document.body || $('drill').contains(focused))) $('drill-next').focus({ preventScroll: true });
  }

  // The robot while it is to be watched; else the question, or the panel, right below the header, which stays.
  look(phase) {
    if (phase === 'watch' || phase === 'acting') return window.scrollTo(0, 0);
    const header = $('verdict').offsetHeight + 8, asks = phase === 'ask';
    const first = asks ? $('drill-question').parentElement : $('drill'), last = asks ? $('drill-choices') : $('drill');
    first.style.scrollMarginTop = `${header}px`;
    const out = first.getBoundingClientRect().top < header || last.getBoundingClientRect().bottom > window.innerHeight;
    if (out) first.scrollIntoView({ block: 'start' });
  }

  list(choices) {
    const listed = JSON.stringify(choices);
    if (listed === this.listed) return;
    this.listed = listed;
    $('drill-choices').replaceChildren(...choices.map((choice, k) => {
      const row = element('li'), button = element('button');
      row.dataset.key = choice.key;
      button.type = 'button';
      button.append(element('kbd', '', k < MOST_KEYS ? String(k + 1) : ''), element('span', '', choice.words));
      button.addEventListener('click', () => this.tell({ do: 'choose', choice: choice.key }));
      row.append(button);
      return row;
    }));
  }

  // The end: each situation with its outcome, and the record to keep.
  summary(drill) {
    $('drill-end').hidden = !drill;
    const record = drill?.record ?? null, shown = JSON.stringify([record?.sha256, drill?.written]);
    if (!record || shown === this.summed) return;
    this.summed = shown;
    const { outcome, situations, not_done: left, operator, minutes } = record;
    $('drill-result').className = outcome === 'passed' ? 'passed' : 'repeat';
    text($('drill-result'), `${outcome === 'passed' ? '✓' : '✗'} ${outcome.toUpperCase()}: ${operator}, ${fixed(minutes, 0)} min`);
    const last = new Map(situations.map((one) => [one.situation, one]));
    const lines = [...last.values()].map((one) => `${one.passed ? '✓ passed' : '✗ to repeat'}: ${one.title}`);
    $('drill-situations').replaceChildren(...[...lines, ...left.map((name) => `– not done: ${name.replaceAll('_', ' ')}`)].map((line) => element('li', '', line)));
    if (this.kept) URL.revokeObjectURL(this.kept);
    this.kept = URL.createObjectURL(new Blob([`${JSON.stringify(record, null, 2)}\n`], { type: 'application/json' }));
    $('drill-save').href = this.kept;
    text($('drill-written'), drill.written);
  }
}
