// The parts of the page that are text: margins, torques, inputs, payload.
import { $, text, element, fixed, nice } from './dom.js';

const UNKNOWN = '-', DASH = '—'; // what a frame says, and is shown, where a number would be one of before
let worst = null;

// Tilt and worst joint, right under the header; `dead` where nothing comes that could say what is true now.
export function showMargins(frame, hello, dead) {
  for (const { side, words, level } of frame.tilt) {
    const box = document.querySelector(`.side-left[data-side="${side}"]`), unknown = dead || words === UNKNOWN;
    // Where the ground is not flat the number is an upper bound: it never shows that all is well.
    box.className = `side-left ${unknown ? 'DEAD' : level || 'BOUND'}`;
    if (!box.firstChild) box.append(element('span', '', side), element('b'));
    text(box.lastChild, unknown ? DASH : /\d/.test(words) ? `${words.replace('<=', '≤')}°` : words);
  }
  worst = frame.worst_joint ?? worst;
  if (worst !== null) showTorque($('worst'), frame.torque[worst], hello.joints[worst].unit, dead);
  text($('attitude'), dead || frame.level === 'STALE' ? '' : attitude(frame.attitude));
  const g = frame.ground, cautious = g.cautious_deg === null ? '' : `, ${fixed(g.cautious_deg)}° taken cautiously`;
  text($('ground'), g.rough ? `${g.words}: upper bound${cautious}` : '');
  text($('map-ground'), g.rough ? '(on flat ground only)' : '');
}

function attitude(a) {
  if (!a) return 'attitude not known';
  const lean = (value, plus, minus) => `${fixed(Math.abs(value))}° ${value >= 0 ? plus : minus}`;
  if (a.slope_deg < 1) return `level: slope ${fixed(a.slope_deg)}°`;
  return `slope ${fixed(a.slope_deg)}°: ${lean(a.pitch_deg, 'nose down', 'nose up')}, ${lean(a.roll_deg, 'right side down', 'left side down')}`;
}

export function showTorques(frame, hello, dead) {
  const box = $('torques');
  frame.torque.forEach((row, k) => {
    showTorque(box.children[k] ?? box.appendChild(element('div')), row, hello.joints[k].unit, dead);
  });
}

function showTorque(line, row, unit, dead) {
  if (!line.firstChild) {
    const track = element('div', 'track');
    track.append(element('div', 'bar'), element('div', 'mark'), element('div', 'mark measured'));
    line.append(element('span'), element('b'), track);
  }
  const [name, said, track] = line.children, limited = row.limit !== null;
  const unknown = dead || row.words === UNKNOWN || row.torque === null;
  line.className = `torque ${unknown ? 'DEAD' : row.level}`;
  text(name, nice(row.joint));
  const numbers = limited ? `${fixed(Math.abs(row.torque))} of ${fixed(row.limit, 0)} ${unit}: ${row.words}` : `${fixed(row.torque)} ${unit}, no limit known`;
  text(said, unknown ? DASH : numbers);
  track.hidden = !limited;
  // The bar's end is 125 % of the limit, the mark the limit itself.
  track.children[0].style.width = `${unknown ? 0 : Math.min(100, (row.use ?? 0) * 80)}%`;
  track.children[1].style.left = '80%';
  track.children[2].hidden = unknown || row.measured === null || !limited;
  if (limited) track.children[2].style.left = `${Math.min(99, (Math.abs(row.measured ?? 0) / row.limit) * 80)}%`;
}

export function showInputs(frame) {
  const body = $('inputs');
  frame.inputs.forEach((row, k) => {
    if (!body.children[k]) {
      const line = element('tr');
      for (let n = 0; n < 5; n++) line.append(element(n ? 'td' : 'th'));
      line.firstChild.scope = 'row';
      body.append(line);
    }
    const cells = body.children[k].children;
    cells[1].className = row.level;
    const words = { OK: 'arriving', WARN: 'doubtful', ERROR: 'not usable', STALE: 'silent' };
    text(cells[0], row.topic || row.name);
    text(cells[1], row.text || words[row.level]);
    text(cells[2], `${fixed(row.rate_hz, 0)} Hz`);
    text(cells[3], row.age_s === null ? 'never' : row.age_s < 1 ? `${fixed(1000 * row.age_s, 0)} ms` : `${fixed(row.age_s)} s`);
    text(cells[4], row.publishers.join(', ') || 'nobody');
  });
  while (body.children.length > frame.inputs.length) body.lastChild.remove();
}

export function showLoad(frame, hello) {
  const { mass_kg, cog_m } = frame.payload;
  text($('load'), `${fixed(mass_kg, 2)} kg at ${cog_m.map((x) => fixed(x, 3)).join(', ')} m in ${hello.payload_link ?? 'no link'}`);
}
