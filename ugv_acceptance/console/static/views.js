// The robot drawn from above, from its right side and from behind, in its posture on its slope.
import { $, brush } from './dom.js';
import { SideView, VIEWS, label, target } from './side_view.js';

const TRAIL = 100; // frames, five seconds
const COLOURS = { WARN: '#a87f00', ERROR: '#c00016' };

export class Views {
  constructor() {
    this.trail = [];
    this.upright = VIEWS.map((view) => new SideView($(view.id), view));
  }

  take(frame) {
    const p = frame.posture;
    if (!p || frame.level === 'STALE') { this.trail.length = 0; return; }
    if (p.plumb) this.trail.push(p.plumb);
    if (this.trail.length > TRAIL) this.trail.shift();
  }

  draw(frame, hello) {
    if (!frame.posture || !frame.attitude) return;
    this.above(frame, hello);
    for (const view of this.upright) view.draw(frame, hello);
  }

  above(frame, hello) {
    const { c, width, height } = brush($('top')), p = frame.posture;
    const points = [...p.polygon, ...p.contacts, p.body[0], p.body[1], ...(p.plumb ? [p.plumb] : []), p.cog];
    const half = Math.max(0.3, ...points.map((q) => Math.max(Math.abs(q[0]), Math.abs(q[1])))) * 1.2;
    const scale = Math.min(width, height) / 2 / half;
    const at = (q) => [width / 2 - q[1] * scale, height / 2 - q[0] * scale];
    const path = (list) => { c.beginPath(); list.forEach((q) => c.lineTo(...at(q))); };
    label(c, 'front', width / 2, 14, 'center');
    label(c, 'left', 4, height / 2, 'left');
    label(c, 'right', width - 4, height / 2, 'right');
    const [lo, hi] = p.body;
    path([[lo[0], lo[1]], [lo[0], hi[1]], [hi[0], hi[1]], [hi[0], lo[1]]]);
    c.closePath(); c.fillStyle = '#e4e4e0'; c.fill();
    if (p.polygon.length) {
      path(p.polygon); c.closePath();
      c.fillStyle = '#cfe0ff'; c.fill(); c.lineWidth = 3; c.strokeStyle = '#0047b3'; c.stroke();
      this.worstEdge(c, at, frame, hello);
    }
    c.lineWidth = 7; c.strokeStyle = '#00000038';
    for (const limb of p.limbs) { path([limb.from, limb.to]); c.stroke(); }
    c.fillStyle = '#0047b3';
    for (const q of p.polygon) { c.beginPath(); c.arc(...at(q), 5, 0, 7); c.fill(); }
    c.lineWidth = 3; c.strokeStyle = '#111';
    path(this.trail); c.stroke();
    if (p.plumb) target(c, ...at(p.plumb), COLOURS[frame.level] ?? '#111');
    else label(c, 'the weight line does not meet the ground', width / 2, height - 8, 'center');
    $('top').setAttribute('aria-label', `From above: ${frame.headline.what} ${frame.headline.number}`);
  }

  worstEdge(c, at, frame, hello) {
    const known = frame.tilt.filter((t) => t.left_deg !== null).sort((a, b) => a.left_deg - b.left_deg)[0];
    if (!known || known.left_deg > hello.tip_warn_deg) return;
    const outward = { front: [1, 0], left: [0, 1], rear: [-1, 0], right: [0, -1] }[known.side];
    const list = frame.posture.polygon;
    list.forEach((a, k) => {
      const b = list[(k + 1) % list.length], n = [b[1] - a[1], a[0] - b[0]], size = Math.hypot(...n);
      if ((n[0] * outward[0] + n[1] * outward[1]) / size < 0.71) return;
      c.beginPath(); c.moveTo(...at(a)); c.lineTo(...at(b));
      c.lineWidth = 9; c.strokeStyle = known.left_deg <= hello.tip_error_deg ? COLOURS.ERROR : COLOURS.WARN; c.stroke();
    });
  }
}
