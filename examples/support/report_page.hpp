// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Scripts of report.html, last part: which panels there are and what each shows. A panel whose data are absent is not made.
#pragma once

namespace searvins::examples {

inline constexpr const char* kReportPage = R"js(
const $ = id => document.getElementById(id);
const legend = entries => '<div class="legend">' +
    entries.map(e => '<span><i' + (e[2] ? ' class="thin"' : '') + ' style="background:' + e[1] + '"></i>' + esc(e[0]) + '</span>')
        .join('') +
    '</div>';
const refreshers = [];
function panel(title, note, entries, options) {
  const box = el('div', 'panel'), head = el('div', 'head');
  $('time').append(box);
  box.append(head);
  const write = () => {
    head.innerHTML =
        '<h3>' + esc(title) + '</h3>' + (note ? '<span class="note">' + esc(note) + '</span>' : '') + (entries ? legend(entries()) : '');
  };
  write();
  refreshers.push(write);
  return new TimeChart(box, options);
}
const worst = () => [4, 3, 2, 1, 0].map(s => C.status[s]);
const outageLegend = () => D.outages ? [['without GNSS', C.outage]] : [];
const used = () => STATUS.map((_, s) => s).filter(s => D.s.includes(s));
const statusLegend = () => used().map(s => [STATUS_TEXT[s], C.status[s]]);
const top = (a, p = 1) => quantile(sorted(a), p);

/* Status along time. */
panel(
    'Solution', 'drag across any chart to zoom in time, double click to see it all',
    () => statusLegend().concat(outageLegend()),
    {height: 30, ticks: [], axis: false, range: () => [0, 1], paint: c => c.ribbon(D.s, C.status)});

/* Errors and sigmas. */
if (has(D.ee)) {
  const axes = [['East', D.ee, D.se], ['North', D.en, D.sn], ['Up', D.eu, D.su]];
  const sizes = sorted([].concat(...axes.map(a => a[1].map(v => ok(v) ? Math.abs(v) : null))));
  let kind = quantile(sizes, 1) > 25 * Math.max(1e-4, quantile(sizes, 0.5)) ? 'asinh' : 'linear';
  const knee = Math.pow(10, Math.round(Math.log10(Math.max(1e-3, quantile(sizes, 0.3)))));
  const charts = axes.map(([name, error, sigma], k) => {
    const three = (sigma || []).map(v => ok(v) ? 3 * v : null), minus = three.map(v => v === null ? null : -v);
    const limit = () => {
      const m = quantile(sizes, 1), b = has(three) ? quantile(sorted(three), kind === 'linear' ? 0.9 : 0.98) : 0;
      return Math.max(m, Math.min(b, kind === 'linear' ? 2.5 * m : 20 * m)) * 1.08 || 1;
    };
    return panel(name + ' error', k ? '' : 'estimate minus truth; shaded: ±3 sigma as reported', k ? null : statusLegend, {
      height: k === 2 ? 141 : 126,
      axis: k === 2,
      scale: kind,
      knee,
      format: axisMetres,
      ticks: 4,
      range: () => [-limit(), limit()],
      paint: c => {
        if (has(three)) c.band(minus, three, C.band);
        c.dots(error, i => C.status[D.s[i]], 1.8, worst());
      },
      rows: i => [[name.toLowerCase() + ' error', metres(error[i])]].concat(sigma && ok(sigma[i]) ? [['1-sigma', metres(sigma[i])]] : [])
    });
  });
  const button = el('button', '', 'logarithmic');
  button.onclick = () => {
    kind = kind === 'linear' ? 'asinh' : 'linear';
    show();
  };
  const show = () => {
    button.setAttribute('aria-pressed', kind === 'asinh');
    for (const c of charts) {
      c.o.scale = kind;
      c.draw();
    }
  };
  $('timebuttons').append(button);
  show();
} else if (has(D.se)) {
  const all = sorted(D.se.concat(D.sn, D.su)).filter(v => v > 0);
  panel('Reported sigma', 'of the position, one sigma', () => [['east', C.cat[0], 1], ['north', C.cat[1], 1], ['up', C.cat[3], 1]], {
    height: 130,
    scale: 'log',
    format: axisMetres,
    range: () => [quantile(all, 0) * 0.7, quantile(all, 1) * 1.4],
    paint: c => {
      c.line(D.su, C.cat[3]);
      c.line(D.sn, C.cat[1]);
      c.line(D.se, C.cat[0]);
    },
    rows: i => [['east', metres(D.se[i])], ['north', metres(D.sn[i])], ['up', metres(D.su[i])]]
  });
}

/* Satellites, signals, weights. */
if (has(D.used) || has(D.seen))
  panel('Satellites', '', () => [['seen', C.muted, 1], ['used', C.accent, 1]].slice(has(D.seen) ? 0 : 1), {
    range: () => [0, Math.max(top(D.used || [0]) || 0, top(D.seen || [0]) || 0) * 1.12 + 1],
    height: 96,
    paint: c => {
      if (has(D.seen)) c.line(D.seen, C.muted);
      if (has(D.used)) c.line(D.used, C.accent, 1.7);
    },
    rows: i => [['seen', D.seen ? D.seen[i] ?? '–' : '–'], ['used', D.used ? D.used[i] ?? '–' : '–']]
  });
if (has(D.cn0))
  panel('Mean C/N0', 'dB-Hz, signals in use', null, {
    height: 84,
    range: () => {
      const s = sorted(D.cn0);
      return [Math.floor(quantile(s, 0) - 1), Math.ceil(quantile(s, 1) + 1)];
    },
    paint: c => c.line(D.cn0, C.cat[3]),
    rows: i => [['mean C/N0', ok(D.cn0[i]) ? D.cn0[i].toFixed(1) + ' dB-Hz' : '–']]
  });
if (D.rejected && D.rejected.some(has)) {
  const sums = D.t.map((_, i) => D.rejected.reduce((s, r) => s + (r[i] || 0), 0));
  const present = D.rejected.map((r, k) => k).filter(k => D.rejected[k].some(v => v > 0));
  if (present.length)
    panel('Rejected signals', 'per epoch, by reason', () => present.map(k => [D.reasons[k], C.cat[k % 8]]), {
      height: 96,
      range: () => [0, top(sums) * 1.1 + 1],
      paint: c => c.stack(present.map(k => D.rejected[k]), present.map(k => C.cat[k % 8])),
      rows: i => present.filter(k => D.rejected[k][i]).map(k => [D.reasons[k], D.rejected[k][i], C.cat[k % 8]])
    });
}
if (has(D.wc) || has(D.wp))
  panel('Mean robust weight', '1: believed as is, 0: ignored', () => [['code', C.cat[0], 1], ['phase', C.cat[1], 1]], {
    height: 92,
    range: () => [0, 1.04],
    ticks: [0, 0.5, 1],
    paint: c => {
      if (has(D.wc)) c.line(D.wc, C.cat[0]);
      if (has(D.wp)) c.line(D.wp, C.cat[1]);
    },
    rows: i => [
        ['code', D.wc && ok(D.wc[i]) ? D.wc[i].toFixed(2) : '–', C.cat[0]],
        ['phase', D.wp && ok(D.wp[i]) ? D.wp[i].toFixed(2) : '–', C.cat[1]]]
  });

/* Integer fixing. */
const outcomeColor = k => k === 0 ? C.status[0] : C.cat[(k + 0) % 8];
if (has(D.outcome)) {
  const present = D.outcomes.map((_, k) => k).filter(k => D.outcome.includes(k));
  panel('Integer fixing', 'what became of the integer vector', () => present.map(k => [D.outcomes[k], outcomeColor(k)]), {
    height: 30,
    ticks: [],
    axis: false,
    range: () => [0, 1],
    paint: c => c.ribbon(D.outcome, D.outcomes.map((_, k) => outcomeColor(k))),
    rows: i => ok(D.outcome[i]) && D.outcome[i] >= 0 ? [['outcome', D.outcomes[D.outcome[i]], outcomeColor(D.outcome[i])]] : []
  });
}
if (has(D.sr))
  panel('Success rate', 'bootstrapped, of the integer vector', D.gate ? () => [['gate ' + D.gate, C.muted, 1]] : null, {
    height: 92,
    range: () => [0, 1.04],
    ticks: [0, 0.5, 1],
    paint: c => {
      if (D.gate) {
        c.g.strokeStyle = C.muted;
        c.g.setLineDash([4, 3]);
        c.g.beginPath();
        c.g.moveTo(c.left, c.y(D.gate));
        c.g.lineTo(c.w, c.y(D.gate));
        c.g.stroke();
        c.g.setLineDash([]);
      }
      c.dots(D.sr, i => C.status[D.s[i]], 1.8, worst());
    },
    rows: i => [['success rate', ok(D.sr[i]) ? D.sr[i].toFixed(4) : '–']]
  });
if (has(D.ratio))
  panel('Ratio', 'second best over best', null, {
    height: 92,
    scale: 'log',
    range: () => [1, Math.max(10, top(D.ratio, 0.995) * 1.3)],
    paint: c => c.dots(D.ratio, i => C.status[D.s[i]], 1.6, worst()),
    rows: i => [['ratio', ok(D.ratio[i]) ? D.ratio[i].toFixed(1) : '–']]
  });
if (has(D.age) && top(D.age) > 0.5 * STEP)
  panel('Age of the base data', '', null, {
    height: 70,
    ticks: 2,
    format: v => short(v) + ' s',
    range: () => [0, top(D.age) * 1.15],
    paint: c => c.line(D.age, C.cat[6]),
    rows: i => [['age', ok(D.age[i]) ? D.age[i].toFixed(1) + ' s' : '–']]
  });
/* Consistency: are the errors as large as the sigmas say? */
if (has(D.nees)) {
  const over = (e, s) => e.map((v, i) => ok(v) && s && s[i] > 0 ? v / s[i] : null);
  const ratios = [['east', over(D.ee, D.se), 0], ['north', over(D.en, D.sn), 1], ['up', over(D.eu, D.su), 3]];
  const sizes = sorted([].concat(...ratios.map(r => r[1].map(v => ok(v) ? Math.abs(v) : null)))),
        reach = Math.max(4, quantile(sizes, 1) * 1.1);
  panel('Error over sigma', 'shaded: ±2, where 95 % belong', () => ratios.map(r => [r[0], C.cat[r[2]]]), {
    height: 118,
    scale: 'asinh',
    knee: 2,
    ticks: [-100, -10, -2, 0, 2, 10, 100],
    range: () => [-reach, reach],
    paint: c => {
      c.stripe(-2, 2, C.band);
      for (const r of ratios) c.dots(r[1], () => C.cat[r[2]], 1.4);
    },
    rows: i => ratios.map(r => [r[0], ok(r[1][i]) ? r[1][i].toFixed(2) : '–', C.cat[r[2]]])
  });
  panel('NEES of the position', 'shaded: 0.22 to 9.35, where 95 % belong; line: 3, its expectation', null, {
    height: 112,
    scale: 'log',
    range: () => [0.01, Math.max(20, top(D.nees) * 1.5)],
    paint: c => {
      c.stripe(0.2158, 9.3484, C.band);
      c.mark(3, C.muted);
      c.dots(D.nees.map(v => ok(v) ? Math.max(v, 0.0101) : null), i => C.status[D.s[i]], 1.6, worst());
    },
    rows: i => [['NEES', ok(D.nees[i]) ? D.nees[i].toFixed(2) : '–']]
  });
}

if (D.integrity && has(D.h) && has(D.se) && has(D.cen)) {
  const bounds = D.se.map((s, i) => {
    const a = s * s, c = D.sn[i] * D.sn[i];
    return ok(s) && ok(D.cen[i]) ? D.integrity.k * Math.sqrt((a + c) / 2 + Math.hypot((a - c) / 2, D.cen[i])) : null;
  });
  const both = sorted(D.h.concat(bounds)).filter(v => v > 0), lo = Math.max(1e-4, quantile(both, 0.01) * 0.7);
  panel('Horizontal error and its bound', stanfordNote(), () => [['bound', C.ink, 1]], {
    height: 150,
    scale: 'log',
    format: axisMetres,
    range: () => [lo, Math.max(quantile(both, 1), D.integrity.limit) * 1.4],
    paint: c => {
      c.mark(D.integrity.limit, C.status[3]);
      c.line(bounds, C.ink, 1.1);
      c.dots(D.h.map(v => ok(v) ? Math.max(v, lo) : null), i => C.status[D.s[i]], 1.7, worst());
    },
    rows: i => [['error', metres(D.h[i])], ['bound', metres(bounds[i])]]
  });
}

/* Motion: velocity, attitude, biases. */
const three = (title, note, names, series, colors, options) => {
  const all = sorted([].concat(...series)), lo = quantile(all, options.log ? 0 : 0.0005), hi = quantile(all, options.log ? 1 : 0.9995),
        room = Math.max((hi - lo) * 0.08, options.least || 0);
  panel(title, note, () => names.map((n, k) => [n, C.cat[colors[k]], 1]), {
    height: options.height || 100,
    scale: options.log ? 'log' : 'linear',
    format: v => short(v) + (options.unit.length > 4 ? '' : options.unit), /* the margin holds no more */
    range: () => options.log ? [lo * 0.7, hi * 1.4] : [lo - room, hi + room],
    paint: c => {
      series.forEach((values, k) => {
        const sigma = options.sigmas && options.sigmas[k];
        if (has(sigma))
          c.band(values.map((v, i) => ok(v) && ok(sigma[i]) ? v - 3 * sigma[i] : null),
                 values.map((v, i) => ok(v) && ok(sigma[i]) ? v + 3 * sigma[i] : null), C.band);
      });
      series.forEach((values, k) => c.line(values, C.cat[colors[k]]));
    },
    rows: i => names.map((n, k) => {
      const v = series[k][i], s = options.sigmas && options.sigmas[k] && options.sigmas[k][i];
      return [n, ok(v) ? v.toFixed(options.digits) + options.unit + (ok(s) ? ' ± ' + s.toFixed(options.digits) : '') : '–', C.cat[colors[k]]];
    })
  });
};
if (has(D.speed) && top(D.speed, 0.95) > 0.5)
  three('Velocity', 'of the antenna', ['east', 'north', 'up'], [D.ve, D.vn, D.vu], [0, 1, 3],
        {unit: ' m/s', digits: 2, sigmas: [D.sve, D.svn, D.svu], height: 112});
if (has(D.hdg)) {
  panel('Heading', 'of the body, clockwise from north', null, {
    height: 96,
    ticks: [0, 90, 180, 270, 360],
    format: v => v + '°',
    range: () => [-8, 368],
    paint: c => c.dots(D.hdg, () => C.accent, 1.4),
    rows: i => [['heading', ok(D.hdg[i]) ? D.hdg[i].toFixed(2) + '°' + (D.shdg && ok(D.shdg[i]) ? ' ± ' + D.shdg[i].toFixed(2) : '') : '–']]
  });
  three('Roll and pitch', 'shaded: ±3 sigma', ['roll', 'pitch'], [D.roll, D.pitch], [0, 1],
        {unit: '°', digits: 2, sigmas: [D.sroll, D.spitch], least: 0.2});
  if (has(D.shdg))
    three('Attitude, 3 sigma', 'as reported', ['roll', 'pitch', 'heading'],
          [D.sroll, D.spitch, D.shdg].map(s => s.map(v => ok(v) ? 3 * v : null)), [0, 1, 6], {unit: '°', digits: 3, log: true});
}
if (has(D.bax))
  three('Accelerometer bias', 'm/s², as estimated', ['right', 'forward', 'up'], [D.bax, D.bay, D.baz], [0, 1, 3],
        {unit: ' m/s²', digits: 4, least: 0.002});
if (has(D.bgx))
  three('Gyroscope bias', 'as estimated', ['right', 'forward', 'up'], [D.bgx, D.bgy, D.bgz], [0, 1, 3],
        {unit: ' °/s', digits: 4, least: 0.002});
if (has(D.ms)) {
  const s = sorted(D.ms).filter(v => v > 0), hi = quantile(s, 1), lo = quantile(s, 0), wide = hi > 30 * lo;
  panel('Solve time', 'wall clock of one update', null, {
    height: 84,
    ticks: 3,
    scale: wide ? 'log' : 'linear',
    format: v => short(v) + ' ms',
    range: () => wide ? [lo * 0.8, hi * 1.3] : [0, hi * 1.15],
    paint: c => c.dots(D.ms.map(v => v > 0 ? v : null), () => C.cat[0], 1.3),
    rows: i => [['solve', ok(D.ms[i]) ? D.ms[i].toFixed(3) + ' ms' : '–']]
  });
}

/* Map. */
const map = new MapView($('maphost'));
$('mapbuttons').querySelectorAll('button').forEach(b => b.onclick = () => {
  const k = b.dataset.do;
  if (k === 'in')
    map.zoom(1.6);
  else if (k === 'out')
    map.zoom(1 / 1.6);
  else {
    map.fit(k === 'fix' && D.s.includes(0) ? 0 : -1);
    map.draw();
  }
});
const mapLegend = () => {
  $('maplegend').innerHTML = legend(statusLegend().concat(D.truth ? [['truth', C.truth, 1]] : []));
};
mapLegend();
refreshers.push(mapLegend);

function card(title, note, entries) {
  const box = el('div', 'card'), head = el('div', 'head');
  $('three').append(box);
  box.append(head);
  const write = () => {
    head.innerHTML =
        '<h2>' + esc(title) + '</h2>' + (note ? '<span class="note">' + esc(note) + '</span>' : '') + (entries ? legend(entries()) : '');
  };
  write();
  refreshers.push(write);
  return box;
}
if (D.scored && has(D.scored.h)) {
  const sets = [
    ['horizontal', D.scored.h, () => C.accent], ['3-D', D.scored.d, () => C.cat[6]], ['horizontal, fixed', D.scored.f, () => C.status[0]]
  ];
  new CdfView(
      card('Error distribution', '', () => sets.filter(s => has(s[1])).map(s => [s[0], s[2](), 1])), sets,
      s => s[0].endsWith('fixed') ? s[1].length : D.scored.n);
}

if (D.integrity && has(D.scored.b))
  new StanfordView(
      card('Stanford diagram', stanfordNote(), null), D.scored.h, D.scored.b, stanfordRange([D.scored.h, D.scored.b]), () => C.accent);

if (D.sky && D.sky.length)
  new SkyView(
      card('Sky', 'colour: C/N0', () => [['25', ramp(25)], ['35', ramp(35)], ['45 dB-Hz', ramp(45)], ['mostly rejected', C.status[3]]]));

if (has(D.ms) && N > 5) {
  const s = sorted(D.ms).filter(v => v > 0);
  if (s.length > 5) new HistogramView(card('Solve time', 'longest ' + quantile(s, 1).toPrecision(3) + ' ms', null), D.ms);
}

matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  readColors();
  refreshers.forEach(f => f());
  shared.charts.forEach(c => c.draw());
});
)js";

}  // namespace searvins::examples
