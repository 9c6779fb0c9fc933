// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Scripts of report.html, first part: the embedded data, colours of the theme, texts of numbers and times, scales and their ticks,
/// and what all charts share (the visible span of time, the epoch under the cursor, the readout).
#pragma once

namespace searvins::examples {

inline constexpr const char* kReportScales = R"js(
'use strict';
const D = JSON.parse(document.getElementById('run-data').textContent);
const N = D.t.length, STATUS = ['fix', 'float', 'dgnss', 'spp', 'dr'];
const STATUS_TEXT = ['fixed', 'float', 'code differences', 'single point', 'dead reckoning'];
let C = {};
function readColors() {
  const style = getComputedStyle(document.documentElement), get = n => style.getPropertyValue('--' + n).trim();
  C = {status: STATUS.map(get), cat: [0, 1, 2, 3, 4, 5, 6, 7].map(i => get('c' + i))};
  for (const n of ['ink', 'muted', 'grid', 'line', 'band', 'truth', 'accent', 'card', 'select', 'outage']) C[n] = get(n);
}
readColors();
const el = (tag, cls, html) => {
  const e = document.createElement(tag);
  if (cls) e.className = cls;
  if (html !== undefined) e.innerHTML = html;
  return e;
};
const esc = s => String(s).replace(/[&<>"]/g, c => ({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;'}[c]));
const ok = v => v !== null && v !== undefined && isFinite(v);
const has = a => Array.isArray(a) && a.some(ok);
const sorted = a => Float64Array.from(a.filter(ok)).sort();
const quantile = (s, p) => {
  if (!s.length) return NaN;
  const r = p * (s.length - 1), i = Math.floor(r);
  return i + 1 < s.length ? s[i] + (r - i) * (s[i + 1] - s[i]) : s[i];
};
const STEP = (() => {
  const d = [];
  for (let i = 1; i < N; ++i) d.push(D.t[i] - D.t[i - 1]);
  return quantile(sorted(d), 0.5) || 1;
})();

/* Text of numbers and times. */
const pad = n => String(n).padStart(2, '0');
function clock(t, digits = 0) {
  const unit = Math.pow(10, digits);
  let s = Math.round((D.sow + t) * unit) / unit;
  s -= Math.floor(s / 86400) * 86400;
  const whole = Math.floor(s + 1e-9), frac = digits ? '.' + String(Math.round((s - whole) * unit)).padStart(digits, '0') : '';
  return pad(Math.floor(whole / 3600)) + ':' + pad(Math.floor(whole / 60) % 60) + ':' + pad(whole % 60) + frac;
}
function metres(v) {
  if (!ok(v)) return '–';
  const a = Math.abs(v);
  return a >= 1000 ? (v / 1000).toFixed(a >= 1e4 ? 1 : 2) + ' km' :
      a >= 10      ? v.toFixed(1) + ' m' :
      a >= 1       ? v.toFixed(2) + ' m' :
      a >= 0.1     ? (v * 100).toFixed(1) + ' cm' :
      a >= 0.01    ? (v * 100).toFixed(2) + ' cm' :
                     (v * 1000).toFixed(1) + ' mm';
}
const short = v => {
  const a = Math.abs(v);
  return a === 0 ? '0' : a >= 1000 ? v / 1000 + 'k' : String(+v.toPrecision(6));
};
const axisMetres = v => {
  const a = Math.abs(v);
  return a === 0  ? '0' :
      a < 0.00995 ? +(v * 1000).toPrecision(3) + ' mm' :
      a < 0.995   ? +(v * 100).toPrecision(3) + ' cm' :
                    +v.toPrecision(4) + ' m';
};
function niceStep(span, count) {
  const raw = span / Math.max(1, count), unit = Math.pow(10, Math.floor(Math.log10(raw))), m = raw / unit;
  return (m <= 1 ? 1 : m <= 2 ? 2 : m <= 5 ? 5 : 10) * unit;
}
function linearTicks(lo, hi, count) {
  const inside = s => Math.floor(hi / s + 1e-9) - Math.ceil(lo / s - 1e-9) + 1;
  let step = niceStep(hi - lo, count);
  if (inside(step) < Math.min(3, count)) step = niceStep(hi - lo, 2 * count); /* a step just too coarse leaves zero alone */
  const out = [];
  for (let v = Math.ceil(lo / step - 1e-9) * step; v <= hi + step * 1e-9; v += step) out.push(Math.abs(v) < step * 1e-9 ? 0 : v);
  return out;
}
function timeTicks(lo, hi, count) {
  const steps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400],
        want = (hi - lo) / Math.max(1, count);
  const step = steps.find(s => s >= want) || 86400, out = [];
  for (let v = Math.ceil((lo + D.sow) / step - 1e-9) * step; v <= hi + D.sow + 1e-9; v += step) out.push(v - D.sow);
  return {step, out};
}

/* Vertical scales: linear; asinh (linear near zero, logarithmic beyond +-knee); log. */
const SCALES = {
  linear: {f: v => v},
  asinh: {f: (v, k) => Math.asinh(v / k)},
  log: {f: v => Math.log10(Math.max(v, 1e-12))},
};
function scaleTicks(kind, lo, hi, count, knee) {
  if (kind === 'linear') return linearTicks(lo, hi, count);
  const out = [];
  if (kind === 'log') {
    const parts = hi / lo < 30 ? [1, 2, 5] : [1];
    for (let e = Math.floor(Math.log10(lo)); e <= Math.log10(hi); ++e)
      for (const m of parts) {
        const v = m * Math.pow(10, e);
        if (v >= lo * 0.999 && v <= hi * 1.001) out.push(v);
      }
    return out;
  }
  const top = Math.max(Math.abs(lo), Math.abs(hi));
  out.push(0);
  for (let e = Math.floor(Math.log10(top) + 1e-9), n = 0; n < 4; --e, ++n) {
    const v = Math.pow(10, e);
    if (v < 0.9 * knee) break;
    if (v <= hi) out.push(v);
    if (-v >= lo) out.push(-v);
  }
  return out;
}

/* What all charts share: the visible span of time, the epoch under the cursor. */
const shared = {
  charts: [],
  span: [D.t[0], D.t[N - 1]],
  full: [D.t[0], D.t[N - 1]],
  hover: -1
};
if (!(shared.full[1] > shared.full[0])) shared.full = shared.span = [D.t[0] - 0.5, D.t[0] + 0.5];
const tip = document.getElementById('tip');
function showTip(event, title, rows) {
  tip.innerHTML = '<b>' + esc(title) + '</b>' +
      rows.map(
              r => '<div><span>' + (r[2] ? '<i style="background:' + r[2] + '"></i>' : '') + esc(r[0]) + '</span><span>' + esc(r[1]) +
                  '</span></div>')
          .join('');
  tip.style.display = 'block';
  const x = event.clientX + 16, w = tip.offsetWidth, h = tip.offsetHeight;
  tip.style.left = (x + w > innerWidth - 8 ? event.clientX - w - 16 : x) + 'px';
  tip.style.top = Math.min(event.clientY + 14, innerHeight - h - 8) + 'px';
}
const hideTip = () => {
  tip.style.display = 'none';
};
function nearestEpoch(t) {
  let a = 0, b = N - 1;
  while (b - a > 1) {
    const m = (a + b) >> 1;
    if (D.t[m] <= t)
      a = m;
    else
      b = m;
  }
  return Math.abs(D.t[a] - t) <= Math.abs(D.t[b] - t) ? a : b;
}
function setHover(i) {
  if (i !== shared.hover) {
    shared.hover = i;
    for (const c of shared.charts) c.overlay();
  }
}
function setSpan(a, b) {
  shared.span = [Math.max(a, shared.full[0]), Math.min(b, shared.full[1])];
  for (const c of shared.charts)
    if (c.timed) c.draw();
}
function readout(i) { return [['', STATUS_TEXT[D.s[i]], C.status[D.s[i]]]]; }
)js";

}  // namespace searvins::examples
