// The safe map of two joints: made by the server, painted once, with the live point, its trail and a mark.
import { $, text, element, brush, degrees, fixed, nice } from './dom.js';

const TRAIL = 200;
const MARGIN = { left: 46, bottom: 34, top: 8, right: 10 };
const CELL = 6;

export class SafeMap {
  constructor(ask) {
    this.ask = ask;
    this.map = null;
    this.trail = [];
    this.mark = null;
    const canvas = $('map');
    canvas.addEventListener('click', (event) => this.press(event));
    canvas.addEventListener('keydown', (event) => this.key(event));
    for (const id of ['axis-x', 'axis-y']) $(id).addEventListener('change', () => this.choose());
  }

  describe(hello) {
    this.hello = hello;
    this.names = hello.joints.map((j) => j.name);
    $('safe-map').hidden = !hello.axes; // a robot without two joints to move
    if (!hello.axes) return;
    ['axis-x', 'axis-y'].forEach((id, k) => {
      $(id).replaceChildren(...this.names.map((name) => { const o = element('option', '', nice(name)); o.value = name; return o; }));
      $(id).value = hello.axes[k];
    });
  }

  choose() {
    this.map = this.mark = null;
    this.trail.length = 0;
    this.ask({ do: 'axes', x: $('axis-x').value, y: $('axis-y').value });
  }

  take(map) {
    this.map = map;
    this.picture = paint(map);
    if (this.mark) this.probe();
  }

  follow(frame) {
    if (!this.map) return;
    const at = [this.map.x, this.map.y].map((name) => frame.q[this.names.indexOf(name)] ?? null);
    if (at.includes(null)) return;
    this.trail.push(at);
    if (this.trail.length > TRAIL) this.trail.shift();
  }

  place(canvas) {
    const { left, right, top, bottom } = MARGIN, m = this.map;
    const width = canvas.clientWidth - left - right, height = canvas.clientHeight - top - bottom;
    const wrap = (v, [a, b]) => (b - a > 6.28 && b - a < 6.3 ? a + ((((v - a) % (b - a)) + (b - a)) % (b - a)) : v);
    return {
      to: ([x, y]) => [left + ((wrap(x, m.x_range) - m.x_range[0]) / (m.x_range[1] - m.x_range[0])) * width,
        top + height - ((wrap(y, m.y_range) - m.y_range[0]) / (m.y_range[1] - m.y_range[0])) * height],
      from: (px, py) => [m.x_range[0] + ((px - left) / width) * (m.x_range[1] - m.x_range[0]),
        m.y_range[0] + ((top + height - py) / height) * (m.y_range[1] - m.y_range[0])],
      width, height,
    };
  }

  press(event) {
    if (!this.map) return;
    const box = $('map').getBoundingClientRect();
    this.mark = this.clamp(this.place($('map')).from(event.clientX - box.left, event.clientY - box.top));
    this.probe();
  }

  key(event) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!this.map || (!step && event.key !== 'Enter')) return;
    event.preventDefault();
    const now = this.mark ?? this.trail.at(-1) ?? [0, 0];
    const size = [this.map.x_range, this.map.y_range].map(([a, b]) => (b - a) / 72);
    this.mark = this.clamp(step ? now.map((v, k) => v + step[k] * size[k]) : now);
    this.probe();
  }

  clamp(at) {
    return at.map((v, k) => Math.min(Math.max(v, [this.map.x_range, this.map.y_range][k][0]), [this.map.x_range, this.map.y_range][k][1]));
  }

  probe() {
    const [x, y] = this.mark;
    this.ask({ do: 'probe', x, y }, (answer) => {
      if (!answer.ok) return text($('probe'), answer.text);
      const p = answer.probe;
      const where = `${nice(this.map.x)} ${this.value(0, p.at[0])}, ${nice(this.map.y)} ${this.value(1, p.at[1])}`;
      const tilt = p.tilt_deg === null ? 'no tilt margin' : p.tilt_deg < 0 ? `tips to the ${p.side}` : `${fixed(p.tilt_deg)}° of tilt left (${p.side})`;
      text($('probe'), `At ${where}: ${tilt}${p.use === null ? '' : `, ${nice(p.joint)} at ${fixed(100 * p.use, 0)} %`}`);
    });
  }

  value(k, number) {
    const joint = this.hello.joints[this.names.indexOf([this.map.x, this.map.y][k])];
    return joint.kind === 'prismatic' ? `${fixed(number, 2)} m` : `${fixed(degrees(number), 0)}°`;
  }

  draw() {
    const canvas = $('map'), { c, height } = brush(canvas), m = this.map;
    if (!m) return;
    const place = this.place(canvas), { left, top } = MARGIN;
    c.imageSmoothingEnabled = false;
    c.drawImage(this.picture, left, top, place.width, place.height);
    c.strokeStyle = '#111'; c.lineWidth = 1; c.strokeRect(left, top, place.width, place.height);
    c.fillStyle = '#111';
    for (const part of [0, 0.25, 0.5, 0.75, 1]) {
      c.textAlign = part === 1 ? 'right' : part ? 'center' : 'left';
      c.fillText(this.value(0, m.x_range[0] + part * (m.x_range[1] - m.x_range[0])), left + part * place.width, height - 18);
      c.textAlign = 'right';
      c.fillText(this.value(1, m.y_range[0] + part * (m.y_range[1] - m.y_range[0])), left - 4, top + (1 - part) * (place.height - 10) + 10);
    }
    c.textAlign = 'center';
    c.fillText(`${nice(m.x)} across, ${nice(m.y)} up`, left + place.width / 2, height - 3);
    c.beginPath();
    let last = null;
    for (const at of this.trail) {
      const p = place.to(at);
      // A turn that goes over the edge is not drawn across the map.
      if (last && Math.hypot(p[0] - last[0], p[1] - last[1]) < place.width / 3) c.lineTo(...p); else c.moveTo(...p);
      last = p;
    }
    c.lineWidth = 3; c.strokeStyle = '#0047b3'; c.stroke();
    if (last) { c.beginPath(); c.arc(...last, 8, 0, 7); c.fillStyle = '#fff'; c.fill(); c.lineWidth = 5; c.stroke(); }
    if (this.mark) {
      const [x, y] = place.to(this.mark);
      c.lineWidth = 3; c.strokeStyle = '#111';
      c.beginPath(); c.moveTo(x - 12, y); c.lineTo(x + 12, y); c.moveTo(x, y - 12); c.lineTo(x, y + 12); c.stroke();
    }
  }
}

// Colours have hatches of their own, for eyes and screens that do not tell colours apart.
const COLOURS = [[[228, 228, 224], [228, 228, 224]], [[255, 224, 122], [138, 101, 0]], [[255, 155, 143], [192, 0, 22]], [[209, 174, 240], [59, 0, 102]], [[51, 0, 10], [90, 20, 30]]];
const HATCH = [() => false, (i, j) => i % 6 === 2 && j % 6 === 2, (i, j) => (i + j) % 6 < 2, (i, j) => (i - j + 6000) % 6 < 2, (i, j) => (i + j) % 6 === 0];

function paint(map) {
  const picture = document.createElement('canvas');
  picture.width = map.rows * CELL; picture.height = map.columns * CELL;
  const c = picture.getContext('2d'), image = c.createImageData(picture.width, picture.height);
  for (let j = 0, k = 0; j < picture.height; j++) {
    const column = map.columns - 1 - Math.floor(j / CELL);
    for (let i = 0; i < picture.width; i++, k += 4) {
      const kind = map.cells.charCodeAt(Math.floor(i / CELL) * map.columns + column) - 48;
      const colour = COLOURS[kind][HATCH[kind](i, j) ? 1 : 0];
      image.data[k] = colour[0]; image.data[k + 1] = colour[1]; image.data[k + 2] = colour[2]; image.data[k + 3] = 255;
    }
  }
  c.putImageData(image, 0, 0);
  return picture;
}
