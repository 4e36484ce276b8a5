// The line under the header: whose numbers these are, the black box, how long it runs, and what is only assumed.
import { $, text } from './dom.js';

const SOURCES = { bag: 'RECORDING, not live', drill: 'DRILL, no real robot' };
const BOXES = { on: '● black box on', off: '○ black box off' };

export function showStatus({ lamps = {}, assumed = '' }) {
  put('source', SOURCES[lamps.source] ?? '');
  const box = lamps.black_box ?? '';
  put('black-box', BOXES[box] ?? (box && `▲ black box: ${box}`));
  $('black-box').classList.toggle('trouble', box !== '' && !(box in BOXES));
  put('running', lamps.running_s == null ? '' : `running ${clock(lamps.running_s)}`);
  put('assumed', assumed && `Assumed: ${assumed}`);
}

function put(id, words) {
  $(id).hidden = !words;
  text($(id), words);
}

function clock(seconds) {
  const two = (n) => String(Math.floor(n)).padStart(2, '0');
  return `${Math.floor(seconds / 3600)}:${two((seconds / 60) % 60)}:${two(seconds % 60)}`;
}
