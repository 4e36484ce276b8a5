// The robot drawn from above, from its right side and from behind, in its posture on its slope.
import { $, brush, fixed } from './dom.js';

const TRAIL = 100; // frames, five seconds
const COLOURS = { OK: '#0b6b2c', WARN: '#a87f00', ERROR: '#c00016' };

export class Views {
  constructor() {
    this.trail = [];
    this.reach = 0.5;
  }

  take(frame) {
    const p = frame.posture;
    if (!p || frame.level === 'STALE') { this.trail.length = 0; return; }
    if (p.plumb) this.trail.push(p.plumb);
    if (this.trail.length > TRAIL) this.trail.shift();
    for (const point of [...p.limbs.flatMap((l) => [l.from, l.to]), ...p.contacts]) this.reach = Math.max(this.reach, 1.08 * Math.hypot(...point));
  }

  draw(frame, hello) {
    if (!frame.posture || !frame.attitude) return;
    const g = frame.attitude.gravity;
    this.above(frame, hello);
    // Seen from the right: forward is right. From behind: the robot's left is left.
    this.upright('from-side', frame, (p) => [p[0], p[2]], [g[0], g[2]], 'rear', 'front');
    this.upright('from-rear', frame, (p) => [-p[1], p[2]], [-g[1], g[2]], 'left', 'right');
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
    $('top').setAttribute('aria-label', `From above: ${frame.left}`);
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

  upright(id, frame, flat, gravity, first, second) {
    const { c, width, height } = brush($(id)), p = frame.posture;
    const size = Math.hypot(...gravity) || 1;
    // Turned so that gravity points down the screen.
    const cos = -gravity[1] / size, sin = -gravity[0] / size;
    const scale = Math.min(width / 2, height * 0.66) / this.reach;
    const z = p.polygon.length ? p.polygon.reduce((s, q) => s + q[2], 0) / p.polygon.length : p.body[0][2];
    // Base_link at 0.7 of the height, higher where the ground would not be seen.
    const origin = Math.min(height * 0.7, height * 0.95 + z * scale);
    const at = (q) => {
      const [u, v] = flat(q);
      return [width / 2 + (u * cos - v * sin) * scale, origin - (u * sin + v * cos) * scale];
    };
    const line = (a, b) => { c.beginPath(); c.moveTo(...at(a)); c.lineTo(...at(b)); c.stroke(); };
    c.lineWidth = 1; c.setLineDash([4, 5]); c.strokeStyle = '#555';
    c.beginPath(); c.moveTo(0, origin); c.lineTo(width, origin); c.stroke();
    c.setLineDash([]);
    const far = 3 * this.reach;
    c.lineWidth = 4; c.strokeStyle = '#6b4a1f';
    if (id === 'from-side') line([-far, 0, z], [far, 0, z]); else line([0, -far, z], [0, far, z]);
    const [lo, hi] = p.body;
    const box = id === 'from-side'
      ? [[lo[0], 0, lo[2]], [hi[0], 0, lo[2]], [hi[0], 0, hi[2]], [lo[0], 0, hi[2]]]
      : [[0, lo[1], lo[2]], [0, hi[1], lo[2]], [0, hi[1], hi[2]], [0, lo[1], hi[2]]];
    c.beginPath(); box.forEach((q) => c.lineTo(...at(q))); c.closePath();
    c.fillStyle = '#c9c9c4'; c.fill(); c.lineWidth = 2; c.strokeStyle = '#111'; c.stroke();
    for (const limb of p.limbs) {
      const row = frame.torque.find((t) => t.joint === limb.joint);
      c.lineWidth = 8; c.strokeStyle = row && row.limit !== null && row.use >= 1 ? COLOURS.ERROR : '#333'; line(limb.from, limb.to);
      c.fillStyle = '#fff'; c.lineWidth = 2; c.strokeStyle = '#111';
      c.beginPath(); c.arc(...at(limb.from), 5, 0, 7); c.fill(); c.stroke();
    }
    if (p.load) {
      const [x, y] = at(p.load);
      c.fillStyle = '#0047b3'; c.fillRect(x - 8, y - 8, 16, 16);
      label(c, `${fixed(frame.payload.mass_kg)} kg`, Math.min(Math.max(x, 24), width - 24), Math.max(y - 12, 14), 'center');
    }
    if (p.plumb) { c.lineWidth = 2; c.strokeStyle = '#111'; c.setLineDash([6, 4]); line(p.cog, p.plumb); c.setLineDash([]); }
    target(c, ...at(p.cog), COLOURS[frame.level] ?? '#111');
    label(c, first, 4, height - 6, 'left'); label(c, second, width - 4, height - 6, 'right');
    const turn = (Math.atan2(sin, cos) * 180) / Math.PI;
    $(id).setAttribute('aria-label', `Robot ${id === 'from-side' ? 'from its right side' : 'from behind'}, leaning ${fixed(turn)} degrees`);
  }
}

function label(c, words, x, y, align) {
  c.textAlign = align; c.lineWidth = 4; c.strokeStyle = '#ffffffd0'; c.strokeText(words, x, y);
  c.fillStyle = '#111'; c.fillText(words, x, y);
}

// The mark of a centre of gravity.
function target(c, x, y, colour) {
  c.fillStyle = '#fff'; c.strokeStyle = '#111'; c.lineWidth = 2;
  c.beginPath(); c.arc(x, y, 10, 0, 7); c.fill(); c.stroke();
  c.fillStyle = colour;
  for (const from of [0, Math.PI]) { c.beginPath(); c.moveTo(x, y); c.arc(x, y, 10, from, from + Math.PI / 2); c.fill(); }
}
