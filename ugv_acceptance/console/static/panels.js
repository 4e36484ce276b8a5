// The parts of the page that are text: verdict, tilt, torques, inputs, payload.
import { $, text, element, fixed, nice } from './dom.js';

const SIGNS = {
  OK: ['M50 4a46 46 0 1 0 .01 0z', '#fff', '✓', '#0b6b2c'],
  WARN: ['M50 6 98 92H2z', '#111', '!', '#ffc400'],
  ERROR: ['M31 4h38l27 27v38l-27 27H31L4 69V31z', '#fff', '!', '#c00016'],
  STALE: ['M8 8h84v84H8z', '#000', '?', '#d0d0d0'],
};
let spoken = '';

export function showVerdict(shown) {
  const level = shown.level;
  document.body.dataset.level = level;
  const [shape, fill, glyph, ink] = SIGNS[level];
  if ($('sign-shape').getAttribute('d') !== shape) {
    $('sign-shape').setAttribute('d', shape);
    $('sign-shape').setAttribute('fill', fill);
    $('sign-glyph').setAttribute('fill', ink);
    text($('sign-glyph'), glyph);
  }
  text($('word'), shown.word);
  text($('cause'), shown.cause);
  text($('advice'), shown.advice);
  text($('left'), shown.left);
  $('verdict').classList.toggle('flash', shown.alerts.some((a) => a.unseen && a.level === 'ERROR'));
  // Numbers change all the time; a screen reader is told when the kind of trouble does.
  const first = shown.alerts.find((a) => a.active);
  const say = `${shown.word} ${first ? first.code + first.subject : ''}`;
  if (say !== spoken) {
    spoken = say;
    text($('spoken'), `${shown.word}. ${shown.cause}. ${shown.advice}`);
  }
}

export function showTilt(frame, hello) {
  for (const { side, left_deg } of frame.tilt) {
    const box = document.querySelector(`.side-left[data-side="${side}"]`);
    // Where the ground is not flat the number is an upper bound: it never shows that all is well.
    const bound = frame.ground.rough && left_deg !== null;
    const shown = left_deg === null ? 'OK' : left_deg <= hello.tip_error_deg ? 'ERROR' : left_deg <= hello.tip_warn_deg ? 'WARN' : 'OK';
    const level = bound && shown === 'OK' ? 'BOUND' : shown;
    box.className = `side-left ${level}`;
    if (!box.firstChild) box.append(element('span', '', side), element('b'));
    text(box.lastChild, left_deg === null ? 'no edge' : `${bound ? '≤ ' : ''}${fixed(left_deg)}°`);
  }
  const g = frame.ground, cautious = g.cautious_deg === null ? '' : `, ${fixed(g.cautious_deg)}° taken cautiously`;
  text($('ground'), !g.words ? '' : g.rough ? `${g.words}: upper bound${cautious}` : `ground: ${g.words}`);
  text($('map-ground'), g.rough ? '(on flat ground only)' : '');
  const a = frame.attitude;
  const lean = (value, plus, minus) => `${fixed(Math.abs(value))}° ${value >= 0 ? plus : minus}`;
  text($('attitude'), !a ? 'attitude not known' : a.slope_deg < 1 ? `level: slope ${fixed(a.slope_deg)}°` : `slope ${fixed(a.slope_deg)}°: ${lean(a.pitch_deg, 'nose down', 'nose up')}, ${lean(a.roll_deg, 'right side down', 'left side down')}`);
}

export function showTorques(frame, hello) {
  const box = $('torques');
  frame.torque.forEach((row, k) => {
    if (!box.children[k]) {
      const line = element('div', 'torque');
      const track = element('div', 'track');
      track.append(element('div', 'bar'), element('div', 'mark'), element('div', 'mark measured'));
      line.append(element('span', '', nice(row.joint)), element('b'), track);
      box.append(line);
    }
    const line = box.children[k], track = line.lastChild, unit = hello.joints[k].unit;
    const use = row.use ?? 0, limited = row.limit !== null;
    const level = !limited ? '' : use >= hello.torque_error ? 'ERROR' : use >= hello.torque_warn ? 'WARN' : 'OK';
    line.className = `torque ${level}`;
    const said = { ERROR: ' OVER', WARN: ' close', OK: '', '': '' }[level];
    text(line.children[1], limited ? `${fixed(Math.abs(row.torque))} of ${fixed(row.limit, 0)} ${unit}: ${fixed(100 * use, 0)} %${said}` : `${fixed(row.torque)} ${unit}, no limit known`);
    track.hidden = !limited;
    // The bar's end is 125 % of the limit, the mark the limit itself.
    track.children[0].style.width = `${Math.min(100, use * 80)}%`;
    track.children[1].style.left = '80%';
    track.children[2].hidden = row.measured === null || !limited;
    if (limited) track.children[2].style.left = `${Math.min(99, (Math.abs(row.measured ?? 0) / row.limit) * 80)}%`;
  });
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
