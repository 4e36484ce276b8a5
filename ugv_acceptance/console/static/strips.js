// Strip charts of the last minute: tilt left to each side, and torques as share of their limits.
import { $, brush, nice } from './dom.js';

const SECONDS = 60;
const EVERY = 250; // ms: in a minute's width nobody sees a twentieth of a second
const LINES = [['#0047b3', []], ['#b3005f', [8, 4]], ['#007a5a', [2, 4]], ['#8a4b00', [12, 3, 3, 3]]];

export class Strips {
  constructor() { this.rows = []; this.due = 0; }

  describe(hello) { this.hello = hello; this.rows.length = 0; }

  take(frame) {
    const t = frame.playback ? frame.playback.position_s : performance.now() / 1000;
    const last = this.rows.at(-1);
    if (last && (t < last.t || t - last.t > SECONDS)) this.rows.length = 0;
    if (last && t === last.t) return;
    const known = frame.level !== 'STALE';
    this.rows.push({ t, tilt: frame.tilt.map((x) => (known ? x.left_deg : null)), use: frame.torque.map((x) => (known && x.limit !== null ? 100 * x.use : null)) });
    while (this.rows.length && t - this.rows[0].t > SECONDS) this.rows.shift();
  }

  draw() {
    const h = this.hello, now = performance.now();
    if (now < this.due) return;
    this.due = now + EVERY;
    this.chart('strip-tilt', 'tilt', h.sides, [[h.tip_warn_deg, '#a87f00'], [h.tip_error_deg, '#c00016']], -10, 60, '°');
    this.chart('strip-torque', 'use', h.joints.map((j) => (j.limit === null ? null : nice(j.name))), [[100 * h.torque_warn, '#a87f00'], [100 * h.torque_error, '#c00016']], 0, 125, ' %');
  }

  chart(id, key, names, limits, low, high, unit) {
    const { c, width, height } = brush($(id)), left = 54, top = 18, bottom = height - 4;
    const end = this.rows.at(-1)?.t ?? 0;
    const x = (t) => left + ((t - end + SECONDS) / SECONDS) * (width - left - 4);
    const y = (v) => bottom - ((Math.min(Math.max(v, low), high) - low) / (high - low)) * (bottom - top);
    c.fillStyle = '#fff'; c.strokeStyle = '#767676'; c.lineWidth = 1; c.strokeRect(left, top, width - left - 4, bottom - top);
    c.textAlign = 'right';
    for (const [value, colour] of limits) {
      c.strokeStyle = colour; c.lineWidth = 2; c.setLineDash([5, 3]);
      c.beginPath(); c.moveTo(left, y(value)); c.lineTo(width - 4, y(value)); c.stroke();
    }
    c.setLineDash([]); c.fillStyle = '#111';
    c.fillText(`${high}${unit}`, left - 4, top + 10); c.fillText(`${low}${unit}`, left - 4, bottom);
    let at = 4;
    names.forEach((name, k) => {
      if (name === null) return;
      const [colour, dash] = LINES[k % LINES.length];
      c.strokeStyle = colour; c.lineWidth = 2.5; c.setLineDash(dash);
      c.beginPath();
      let down = false;
      for (const row of this.rows) {
        const value = row[key][k];
        if (value === null) { down = false; continue; }
        if (down) c.lineTo(x(row.t), y(value)); else c.moveTo(x(row.t), y(value));
        down = true;
      }
      c.stroke();
      c.beginPath(); c.moveTo(at, 9); c.lineTo(at + 22, 9); c.stroke();
      c.textAlign = 'left'; c.fillStyle = '#111'; c.fillText(name, at + 26, 13);
      at += 36 + c.measureText(name).width;
    });
    c.setLineDash([]);
  }
}
