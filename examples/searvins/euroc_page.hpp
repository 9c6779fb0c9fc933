// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Script of the report of a stereo-inertial run: which panels there are and what each shows. It follows the scripts of scales, charts and
/// map (examples/support/report_*.hpp). The three states of a frame take the places 0, 2 and 4 of their five colours.
#pragma once

namespace searvins::examples {

inline constexpr const char* kEurocPage = R"js(
const $ = id => document.getElementById(id);
const STATE_TEXT = {0: 'points admitted', 2: 'at rest', 4: 'inertial unit alone'};
function readout(i) { return [['', STATE_TEXT[D.s[i]], C.status[D.s[i]]]]; }
const legend = entries => '<div class="legend">' +
    entries.map(e => '<span><i' + (e[2] ? ' class="thin"' : '') + ' style="background:' + e[1] + '"></i>' + esc(e[0]) + '</span>').join('') +
    '</div>';
const refreshers = [];
function panel(title, note, entries, options) {
  const box = el('div', 'panel'), head = el('div', 'head');
  $('time').append(box);
  box.append(head);
  const write = () => {
    head.innerHTML = '<h3>' + esc(title) + '</h3>' + (note ? '<span class="note">' + esc(note) + '</span>' : '') + (entries ? legend(entries()) : '');
  };
  write();
  refreshers.push(write);
  return new TimeChart(box, options);
}
const top = (a, p = 1) => quantile(sorted(a), p);
const states = () => [0, 2, 4].filter(s => D.s.includes(s)).map(s => [STATE_TEXT[s], C.status[s]]);
const lines = (title, note, names, series, colors, format, digits, least, height) => {
  const all = sorted([].concat(...series)), lo = Math.min(0, quantile(all, 0)), hi = Math.max(0, quantile(all, 1)),
        room = Math.max((hi - lo) * 0.08, least);
  panel(title, note, () => names.map((n, k) => [n, C.cat[colors[k]], 1]), {
    height: height || 100,
    format,
    range: () => [lo < 0 ? lo - room : 0, hi + room],
    paint: c => series.forEach((s, k) => c.line(s, C.cat[colors[k]])),
    rows: i => names.map((n, k) => [n, ok(series[k][i]) ? (digits < 0 ? metres(series[k][i]) : series[k][i].toFixed(digits)) : '–', C.cat[colors[k]]])
  });
};

panel('Frames', 'drag across any chart to zoom in time, double click to see it all', states,
      {height: 30, ticks: [], axis: false, range: () => [0, 1], paint: c => c.ribbon(D.s, C.status)});
if (has(D.d)) {
  lines('Error after alignment', 'estimate minus truth; yaw and position aligned', ['east', 'north', 'up'], [D.ee, D.en, D.eu], [0, 1, 3], axisMetres, -1, 1e-3, 130);
  lines('Distance from the truth', '', ['3-D'], [D.d], [6], axisMetres, -1, 1e-3, 84);
}
lines('Stereo points', 'per frame', ['offered', 'admitted'], [D.offered, D.admitted], [5, 3], short, 0, 5, 110);
if (has(D.speed)) lines('Speed', 'm/s', ['speed'], [D.speed], [0], short, 2, 0.05, 84);
if (has(D.sigma)) lines('Reported sigma', 'of the position, since the beginning', ['3-D'], [D.sigma], [4], axisMetres, -1, 1e-3, 84);
lines('Time per frame', 'ms', ['frontend', 'estimator'], [D.fe, D.ms], [5, 0], short, 1, 1, 96);

const map = new MapView($('maphost'));
$('mapbuttons').querySelectorAll('button').forEach(b => b.onclick = () => {
  const k = b.dataset.do;
  if (k === 'in')
    map.zoom(1.6);
  else if (k === 'out')
    map.zoom(1 / 1.6);
  else {
    map.fit();
    map.draw();
  }
});
const mapLegend = () => {
  $('maplegend').innerHTML = legend(states().concat(D.truth ? [['truth', C.truth, 1]] : []));
};
mapLegend();
refreshers.push(mapLegend);
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  readColors();
  refreshers.forEach(f => f());
  shared.charts.forEach(c => c.draw());
});
)js";

}  // namespace searvins::examples
