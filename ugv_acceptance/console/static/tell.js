// What an operator tells the monitor: the ground and the payload. Who says so goes with it into the monitor's log.
import { $, element, say } from './dom.js';

const KINDS = ['flat', 'uneven', 'stairs'];

export const who = () => ({ by: $('operator').value, note: $('note').value });

export class Tell {
  constructor(ask) {
    $('ground-kind').replaceChildren(...KINDS.map((kind) => { const o = element('option', '', kind); o.value = kind; return o; }));
    this.form('ground-form', () => ask({ do: 'ground', kind: $('ground-kind').value, ...who() }, say('answer')));
    this.form('load-form', () => {
      const [mass_kg, x, y, z] = ['mass', 'x', 'y', 'z'].map((k) => Number($(`load-${k}`).value));
      ask({ do: 'payload', mass_kg, cog_m: [x, y, z], ...who() }, say('answer'));
    });
  }

  form(id, send) {
    $(id).addEventListener('submit', (event) => { event.preventDefault(); send(); });
  }

  describe(hello) {
    $('tell').hidden = hello.source !== 'live'; // a recording cannot be told anything
    $('load-form').hidden = !hello.payload_link;
  }

  // The choice is the ground in force, whoever told it, until somebody chooses another.
  show(frame) {
    const kind = frame.ground.words.split(' ')[0];
    if (kind === this.kind || !KINDS.includes(kind)) return;
    this.kind = $('ground-kind').value = kind;
  }
}
