// One voice at a time. Browsers keep sound off until a person presses something: the button says so.
import { $, text } from './dom.js';

// Level -> tones (Hz) and seconds between calls; an acknowledged alert is silent.
const CALLS = { ERROR: [[880, 660, 880, 660], 1.2], STALE: [[330, 330], 2.0], WARN: [[660], 6.0] };

export class Sound {
  constructor() {
    this.audio = null;
    this.next = 0;
  }

  async toggle() {
    if (this.audio) {
      await this.audio.close();
      this.audio = null;
    } else {
      this.audio = new AudioContext();
      await this.audio.resume();
      this.next = 0;
    }
    this.say('armed');
  }

  say(state) {
    const on = this.audio !== null;
    document.body.dataset.sound = on ? state : 'off';
    $('arm').setAttribute('aria-pressed', String(on));
    text($('arm'), on ? 'Sound is on: press to stop' : 'Sound is off: press to arm');
  }

  follow(shown) {
    if (!this.audio) return;
    const unseen = shown.cards.filter((card) => card.unseen && card.active).map((card) => card.level);
    const level = shown.level === 'STALE' ? 'STALE' : ['ERROR', 'WARN'].find((x) => unseen.includes(x));
    if (!level) { this.next = 0; this.say('armed'); return; }
    this.say('sounding');
    const now = this.audio.currentTime;
    if (now < this.next) return;
    const [tones, pause] = CALLS[level];
    tones.forEach((tone, k) => this.beep(tone, now + 0.16 * k));
    this.next = now + Math.max(pause, 0.16 * tones.length);
  }

  beep(tone, when) {
    const voice = this.audio.createOscillator(), gain = this.audio.createGain();
    voice.frequency.value = tone;
    voice.type = 'square';
    gain.gain.setValueAtTime(0.0001, when);
    gain.gain.exponentialRampToValueAtTime(0.25, when + 0.02);
    gain.gain.exponentialRampToValueAtTime(0.0001, when + 0.14);
    voice.connect(gain).connect(this.audio.destination);
    voice.start(when);
    voice.stop(when + 0.15);
  }
}
