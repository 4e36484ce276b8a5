// Small helpers of the page. All text goes in as text, never as markup.
export const $ = (id) => document.getElementById(id);

export function text(node, value) {
  if (node.textContent !== value) node.textContent = value;
}

export function element(tag, className, content) {
  const node = document.createElement(tag);
  if (className) node.className = className;
  if (content !== undefined) node.textContent = content;
  return node;
}

// What the server answered, where it was asked, for a while.
export const say = (id) => (answer) => {
  const said = answer.ok || answer.text.startsWith('refused') ? answer.text : `refused: ${answer.text}`;
  text($(id), said);
  setTimeout(() => { if ($(id).textContent === said) text($(id), ''); }, 8000);
};

export const degrees = (radians) => (radians * 180) / Math.PI;
export const fixed = (value, digits = 1) => (value === null || value === undefined ? '–' : value.toFixed(digits));
export const nice = (name) => name.replace(/_joint$/, '').replaceAll('_', ' ');

// A canvas at the screen's own resolution: context and size in CSS pixels, cleared.
export function brush(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const w = Math.round(width * ratio), h = Math.round(height * ratio);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const c = canvas.getContext('2d');
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, width, height);
  c.font = '14px system-ui, "DejaVu Sans", sans-serif';
  c.lineJoin = c.lineCap = 'round';
  return { c, width, height };
}
