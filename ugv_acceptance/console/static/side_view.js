// The robot as it is, from its right side or from behind: its shapes on their slope, the plumb line from its centre of gravity to the
// ground, what it stands on, and the edge over which it would tip. Down on the screen is where gravity points.
import { brush, fixed } from './dom.js';

const COLOURS = { WARN: '#a87f00', ERROR: '#c00016' };
const INK = '#111', FILL = '#c9c9c4', GROUND = '#6b4a1f', EARTH = '#efe8dd', BLUE = '#0047b3';
const TIPPED = -20; // degrees of tilt left: it no longer stands on the ground that is drawn

// Which way a view looks: what is to the right on the screen, and its sides.
export const VIEWS = [
  { id: 'from-side', words: 'from its right side', across: (p) => p[0], deep: 1, sides: ['rear', 'front'] },
  { id: 'from-rear', words: 'from behind', across: (p) => -p[1], deep: 0, sides: ['left', 'right'] },
];

export class SideView {
  constructor(canvas, view) { this.canvas = canvas; this.view = view; this.box = null; this.robot = null; this.drawn = ''; this.outlined = ''; }

  draw(frame, hello) {
    const p = frame.posture, g = frame.attitude.gravity;
    const [gu, gv] = [this.view.across(g), g[2]], size = Math.hypot(gu, gv) || 1, cos = -gv / size, sin = -gu / size;
    // What nobody sees is not drawn again: a tenth of a degree, a few millimetres.
    const seen = [p.places, p.cog, p.load, (p.plumb ?? []).map((x) => x.toFixed(2)), sin.toFixed(3), cos > 0, frame.payload.mass_kg,
      frame.tilt.map((t) => [words_of(t), t.level]), frame.torque.map((t) => t.level ?? t.use >= 1), this.canvas.clientWidth, this.canvas.clientHeight, window.devicePixelRatio];
    const now = JSON.stringify(seen);
    if (now === this.drawn && this.robot === hello.robot) return;
    this.drawn = now;
    const { c, width, height } = brush(this.canvas);
    // In metres from base_link, gravity down.
    const turned = ([u, v]) => [u * cos - v * sin, u * sin + v * cos], flat = (q) => turned([this.view.across(q), q[2]]);
    const shapes = this.outlines(p, hello).map((s) => ({ ...s, points: s.points.map(turned) }));
    const ground = support(p, this.view, flat), cog = flat(p.cog), plumb = p.plumb && flat(p.plumb);
    this.grow(hello, shapes, [...p.limbs.flatMap((l) => [l.from, l.to]), ...p.contacts, ...p.body].map(flat), [cog, ...ground]);
    const font = Math.round(Math.min(20, Math.max(14, height / 16)));
    c.font = `${font}px system-ui, "DejaVu Sans", sans-serif`;
    const [x0, y0, x1, y1] = this.box, room = { side: 12, top: 12, foot: 2.2 * font };
    const scale = Math.min((width - 2 * room.side) / (x1 - x0), (height - room.top - room.foot) / (y1 - y0));
    const middle = width / 2 - ((x0 + x1) / 2) * scale, bottom = height - room.foot + y0 * scale;
    const at = (q) => [middle + q[0] * scale, bottom - q[1] * scale];
    const pen = { c, at, width, height, font, scale, unit: Math.max(1, Math.min(2, height / 260)) };
    const fallen = frame.tilt.some((t) => t.left_deg !== null && t.left_deg <= TIPPED);
    earth(pen, ground, fallen);
    solids(pen, shapes, frame);
    limbs(pen, p, flat, frame);
    stands(pen, ground);
    const told = this.tipping(pen, frame, hello, ground, plumb);
    if (p.load) load(pen, flat(p.load), frame.payload.mass_kg);
    weight(pen, cog, plumb, COLOURS[told?.level]);
    const turn = slope(pen, ground, fallen);
    this.corners(pen, frame);
    this.canvas.setAttribute('aria-label', `Robot ${this.view.words}, on a slope of ${fixed(turn)} degrees${told ? `; nearest edge: ${told.side}, ${told.words}` : ''}`);
  }

  // The outlines of a posture, level: they are found anew only when a joint has moved.
  outlines(p, hello) {
    const posture = JSON.stringify(p.places);
    if (posture !== this.outlined || this.robot !== hello.robot) {
      this.outlined = posture;
      this.shapes = (hello.solids ?? []).map((s) => ({ joint: s.joint, radius: s.radius_m, points: hull(placed(s, p.places).map((q) => [this.view.across(q), q[2]])) }));
    }
    return this.shapes;
  }

  // The picture only grows, so that it does not jump while the arm moves.
  grow(hello, shapes, points, more) {
    if (this.robot !== hello.robot) { this.robot = hello.robot; this.box = [Infinity, Infinity, -Infinity, -Infinity]; }
    const take = (q, r) => {
      const b = this.box;
      this.box = [Math.min(b[0], q[0] - r), Math.min(b[1], q[1] - r), Math.max(b[2], q[0] + r), Math.max(b[3], q[1] + r)];
    };
    for (const s of shapes) for (const q of s.points) take(q, s.radius + 0.03);
    for (const q of [...points, ...more]) take(q, 0.05);
  }

  // Marks the edge of this view over which the robot would tip first; returns its side.
  tipping(pen, frame, hello, ground, plumb) {
    const rows = frame.tilt.filter((t) => this.view.sides.includes(t.side) && t.left_deg !== null).sort((a, b) => a.left_deg - b.left_deg);
    if (!rows.length || ground.length < 2) return null;
    const row = rows[0], level = level_of(row, hello), edge = ground[row.side === this.view.sides[0] ? 0 : 1];
    const { c, at, unit } = pen, [x, y] = at(edge), colour = COLOURS[level] ?? INK, r = 8 * unit;
    if (plumb && row.left_deg < 0) { c.strokeStyle = COLOURS.ERROR; c.lineWidth = 4 * unit; line(pen, edge, plumb); }
    c.beginPath(); c.moveTo(x, y + 2); c.lineTo(x - r, y + 2 + 1.5 * r); c.lineTo(x + r, y + 2 + 1.5 * r); c.closePath();
    c.fillStyle = COLOURS[level] ?? '#fff'; c.fill(); c.lineWidth = 2 * unit; c.strokeStyle = colour; c.stroke();
    return { side: row.side, level, words: words_of(row) };
  }

  corners(pen, frame) {
    const { c, width, height, font } = pen;
    this.view.sides.forEach((side, k) => {
      const row = frame.tilt.find((t) => t.side === side);
      c.font = `${font}px system-ui, "DejaVu Sans", sans-serif`;
      label(c, `${side} ${row ? words_of(row) : ''}`.trim(), k ? width - 4 : 4, height - 6, k ? 'right' : 'left');
    });
  }
}

const words_of = (row) => {
  // Whole degrees from ten on, cut as everywhere.
  const words = (row.words ?? (row.left_deg === null ? '–' : fixed(row.left_deg))).replace(/(-?\d{2,})\.(\d)/, (_, n, d) => (n < 0 && d !== '0' ? n - 1 : n));
  return /\d$/.test(words) ? `${words}°` : words;
};

function level_of(row, hello) {
  if (row.level !== undefined) return row.level;
  return row.left_deg <= hello.tip_error_deg ? 'ERROR' : row.left_deg <= hello.tip_warn_deg ? 'WARN' : 'OK';
}

// The points of a shape in base_link; a place is a rotation by rows and an origin.
function placed(solid, places) {
  if (solid.place === null) return solid.points;
  const m = places?.[solid.place];
  if (!m) return [];
  return solid.points.map(([x, y, z]) => [0, 3, 6].map((k) => m[k] * x + m[k + 1] * y + m[k + 2] * z + m[9 + k / 3]));
}

// The two ends of what it stands on, left and right on the screen, in a section through the plumb line; of a robot that stands on
// nothing a line below its body.
function support(p, view, flat) {
  const body = [p.body[0], [p.body[1][0], p.body[1][1], p.body[0][2]]], feet = p.polygon.length ? p.polygon : body;
  const deep = feet.map((q) => q[view.deep]), at = (p.plumb ?? p.cog)[view.deep], level = Math.min(Math.max(at, Math.min(...deep)), Math.max(...deep)), cuts = [];
  feet.forEach((a, k) => {
    const b = feet[(k + 1) % feet.length], start = a[view.deep] - level, end = b[view.deep] - level;
    if (start === 0 && end === 0) cuts.push(a, b);
    else if (start * end <= 0) cuts.push(a.map((x, i) => x + (start / (start - end)) * (b[i] - x)));
  });
  if (!p.polygon.length) cuts.splice(0, cuts.length, ...body);
  cuts.sort((a, b) => view.across(a) - view.across(b));
  return [flat(cuts[0]), flat(cuts[cuts.length - 1])];
}

function hull(points) {
  if (points.length < 3) return points;
  const order = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]), found = [];
  const left = (a, b, q) => (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]);
  for (const run of [order, [...order].reverse()]) {
    const base = found.length;
    for (const q of run) {
      while (found.length - base >= 2 && left(found[found.length - 2], found[found.length - 1], q) <= 0) found.pop();
      found.push(q);
    }
    found.pop();
  }
  return found;
}

function line({ c, at }, a, b) { c.beginPath(); c.moveTo(...at(a)); c.lineTo(...at(b)); c.stroke(); }

function earth(pen, [a, b], fallen) {
  const { c, at, width, height, unit } = pen, [ax, ay] = at(a), [bx, by] = at(b);
  const size = Math.hypot(bx - ax, by - ay) || 1, far = 4 * (width + height), dx = ((bx - ax) / size) * far, dy = ((by - ay) / size) * far;
  if (!fallen) {
    c.beginPath(); c.moveTo(ax - dx, ay - dy); c.lineTo(bx + dx, by + dy); c.lineTo(bx + dx - dy, by + dy + dx); c.lineTo(ax - dx - dy, ay - dy + dx); c.closePath();
    c.fillStyle = EARTH; c.fill();
  }
  c.lineWidth = 3 * unit; c.strokeStyle = GROUND; c.setLineDash(fallen ? [8, 7] : []);
  c.beginPath(); c.moveTo(ax - dx, ay - dy); c.lineTo(bx + dx, by + dy); c.stroke(); c.setLineDash([]);
}

function solids(pen, shapes, frame) {
  const { c, at, scale, unit } = pen;
  const level = new Map(frame.torque.map((t) => [t.joint, t.level ?? (t.limit !== null && t.use >= 1 ? 'ERROR' : 'OK')]));
  c.lineWidth = 1.5 * unit;
  for (const s of shapes) {
    if (!s.points.length) continue;
    c.beginPath();
    if (s.radius > 0) { const [x, y] = at(s.points[0]); c.arc(x, y, s.radius * scale, 0, 7); } else s.points.forEach((q) => c.lineTo(...at(q)));
    c.closePath();
    const over = level.get(s.joint) === 'ERROR';
    c.fillStyle = over ? '#f3b9bd' : FILL; c.strokeStyle = over ? COLOURS.ERROR : '#333'; c.fill(); c.stroke();
  }
}

function limbs(pen, p, flat, frame) {
  const { c, at, unit } = pen;
  for (const limb of p.limbs) {
    const row = frame.torque.find((t) => t.joint === limb.joint), over = row && row.limit !== null && row.use >= 1;
    if (limb.bare !== false) { c.lineWidth = 8 * unit; c.strokeStyle = over ? COLOURS.ERROR : '#333'; line(pen, flat(limb.from), flat(limb.to)); }
    c.fillStyle = '#fff'; c.lineWidth = 2 * unit; c.strokeStyle = over ? COLOURS.ERROR : INK;
    c.beginPath(); c.arc(...at(flat(limb.from)), 4 * unit, 0, 7); c.fill(); c.stroke();
  }
}

function stands(pen, ground) {
  const { c, at, unit } = pen;
  c.strokeStyle = c.fillStyle = BLUE; c.lineWidth = 5 * unit; line(pen, ...ground);
  for (const q of ground) { c.beginPath(); c.arc(...at(q), 5 * unit, 0, 7); c.fill(); }
}

function load(pen, q, mass) {
  const { c, at, width, font, unit } = pen, [x, y] = at(q), r = 7 * unit;
  c.fillStyle = BLUE; c.fillRect(x - r, y - r, 2 * r, 2 * r);
  const words = `${fixed(mass)} kg`, half = c.measureText(words).width / 2 + 4;
  label(c, words, Math.min(Math.max(x, half), width - half), Math.max(y - 1.6 * r, font), 'center');
}

function weight(pen, cog, plumb, colour) {
  const { c, at, unit } = pen;
  if (plumb) {
    c.lineWidth = 2 * unit; c.strokeStyle = INK; c.setLineDash([7, 5]); line(pen, cog, plumb); c.setLineDash([]);
    const [x, y] = at(plumb);
    c.fillStyle = INK; c.beginPath(); c.moveTo(x, y); c.lineTo(x - 5 * unit, y - 9 * unit); c.lineTo(x + 5 * unit, y - 9 * unit); c.closePath(); c.fill();
  }
  target(c, ...at(cog), colour ?? INK, 8 * unit);
}

// The slope in degrees, beside a level line.
function slope(pen, [a, b], fallen) {
  const { c, at, width, font } = pen, [ax, ay] = at(a), [bx, by] = at(b), turn = (Math.atan2(ay - by, bx - ax) * 180) / Math.PI;
  if (fallen) label(c, 'ground as it stood', width / 2, font + 2, 'center');
  else if (Math.abs(turn) >= 0.5) label(c, `slope ${fixed(Math.abs(turn))}°`, turn > 0 ? 4 : width - 4, font + 2, turn > 0 ? 'left' : 'right');
  return Math.abs(turn);
}

export function label(c, words, x, y, align) {
  c.textAlign = align; c.lineWidth = 4; c.strokeStyle = '#ffffffd0'; c.strokeText(words, x, y);
  c.fillStyle = INK; c.fillText(words, x, y);
}

// The mark of a centre of gravity.
export function target(c, x, y, colour, r = 10) {
  c.fillStyle = '#fff'; c.strokeStyle = INK; c.lineWidth = 2;
  c.beginPath(); c.arc(x, y, r, 0, 7); c.fill(); c.stroke();
  c.fillStyle = colour;
  for (const from of [0, Math.PI]) { c.beginPath(); c.moveTo(x, y); c.arc(x, y, r, from, from + Math.PI / 2); c.fill(); }
}
