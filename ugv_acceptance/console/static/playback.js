// Play, pause, speed and the timeline of a recording; hidden where the robot is live.
import { $, text, element, brush, fixed } from './dom.js';

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const COLOURS = { WARN: '#d79f00', ERROR: '#c00016', STALE: '#5d5d5d' };

export class Playback {
  constructor(ask) {
    this.ask = ask;
    this.timeline = null;
    $('speed').replaceChildren(...SPEEDS.map((s) => { const o = element('option', '', `${s} x`); o.value = s; return o; }));
    $('speed').value = '1';
    $('play').addEventListener('click', () => ask({ do: this.playing ? 'pause' : 'play' }));
    $('speed').addEventListener('change', () => ask({ do: 'speed', speed: Number($('speed').value) }));
    $('seek').addEventListener('input', () => ask({ do: 'seek', to_s: Number($('seek').value) }));
    window.addEventListener('resize', () => this.draw());
  }

  describe(hello) {
    this.timeline = hello.timeline ?? null;
    $('playback').hidden = $('jumps-box').hidden = !this.timeline;
    if (!this.timeline) return;
    $('seek').max = this.timeline.duration_s;
    $('jumps').replaceChildren(...this.timeline.alerts.map((alert) => {
      const row = element('li'), button = element('button', '', `${fixed(alert.from_s)} s: ${alert.word}: ${alert.text}`);
      button.type = 'button';
      button.addEventListener('click', () => this.ask({ do: 'seek', to_s: alert.from_s }));
      row.append(button);
      return row;
    }));
    this.draw();
  }

  show(frame) {
    if (!frame.playback || !this.timeline) return;
    const { position_s, playing, speed } = frame.playback;
    this.playing = playing;
    text($('play'), playing ? 'Pause' : 'Play');
    if (document.activeElement !== $('speed')) $('speed').value = String(speed);
    if (document.activeElement !== $('seek') || playing) $('seek').value = position_s;
    text($('position'), `${fixed(position_s)} of ${fixed(this.timeline.duration_s)} s`);
  }

  draw() {
    if (!this.timeline) return;
    const { c, width, height } = brush($('timeline')), t = this.timeline, lane = 12;
    const x = (s) => 8 + (s / Math.max(t.duration_s, 1e-9)) * (width - 16);
    c.fillStyle = '#eee'; c.fillRect(8, 0, width - 16, height);
    for (const level of ['STALE', 'WARN', 'ERROR']) {
      for (const alert of t.alerts.filter((a) => a.level === level)) {
        c.fillStyle = COLOURS[level];
        const row = { ERROR: 0, WARN: 1, STALE: 2 }[level];
        c.fillRect(x(alert.from_s), row * lane, Math.max(2, x(alert.to_s) - x(alert.from_s)), lane - 1);
      }
    }
    c.strokeStyle = '#0047b3'; c.lineWidth = 1.5; c.beginPath();
    let down = false;
    t.tilt_deg.forEach((value, k) => {
      if (value === null) { down = false; return; }
      const at = [x(((k + 0.5) / t.tilt_deg.length) * t.duration_s), height - 2 - (Math.min(Math.max(value, 0), 45) / 45) * (height - 4)];
      if (down) c.lineTo(...at); else c.moveTo(...at);
      down = true;
    });
    c.stroke();
    $('timeline').setAttribute('aria-label', `Timeline: ${t.alerts.length} alerts in ${fixed(t.duration_s)} s, verdict ${t.verdict}`);
  }
}
