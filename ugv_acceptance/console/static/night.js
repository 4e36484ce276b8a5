// Day or night: what was chosen here last, else what the system asks for.
import { $, text } from './dom.js';

const KEY = 'ugv-acceptance-night';
const dark = window.matchMedia('(prefers-color-scheme: dark)');

function chosen() {
  try { return localStorage.getItem(KEY); } catch { return null; } // a browser that keeps nothing
}

function show() {
  const night = (chosen() ?? (dark.matches ? 'on' : 'off')) === 'on';
  document.documentElement.dataset.theme = night ? 'night' : 'day';
  $('night').setAttribute('aria-pressed', String(night));
  text($('night'), night ? 'Day' : 'Night');
}

export function follow() {
  $('night').addEventListener('click', () => {
    const next = document.documentElement.dataset.theme === 'night' ? 'off' : 'on';
    try { localStorage.setItem(KEY, next); } catch { document.documentElement.dataset.theme = next === 'on' ? 'night' : 'day'; return; }
    show();
  });
  dark.addEventListener('change', show);
  show();
}
