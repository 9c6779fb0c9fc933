// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Scripts of report.html, fourth part: the charts without a time axis. Error distribution, sky, solve times.
#pragma once

namespace searvins::examples {

inline constexpr const char* kReportDistributions = R"js(
/* Distribution of errors over a logarithmic axis. Shares are of all evaluation epochs: a curve ends below 100 % where epochs miss. */
class CdfView extends Layers {
  constructor(host, sets, total) {
    super(host, 286);
    this.total = total;
    this.sets = sets.map(s => [s[0], sorted(s[1]), s[2]]).filter(s => s[1].length);
    let lo = Infinity, hi = 0;
    for (const s of this.sets) {
      lo = Math.min(lo, Math.max(1e-4, quantile(s[1], 0.02)));
      hi = Math.max(hi, quantile(s[1], 1));
    }
    this.lo = Math.pow(10, Math.floor(Math.log10(lo)));
    this.hi = Math.pow(10, Math.ceil(Math.log10(Math.max(hi, 2 * lo)) + 1e-9));
    if (this.hi / this.lo < 99) this.hi = this.lo * 100;
    this.front.addEventListener('pointermove', e => {
      const r = this.box.getBoundingClientRect(),
            v = this.lo * Math.pow(this.hi / this.lo, Math.max(0, Math.min(1, (e.clientX - r.left - 40) / (this.w - 54))));
      this.at = v;
      this.overlay();
      showTip(e, 'within ' + metres(v), this.sets.map(s => [s[0], (100 * this.share(s, v)).toFixed(1) + ' %', s[2]()]));
    });
    this.front.addEventListener('pointerleave', () => {
      this.at = 0;
      hideTip();
      this.overlay();
    });
  }
  share(s, v) {
    let a = 0, b = s[1].length;
    while (a < b) {
      const m = (a + b) >> 1;
      if (s[1][m] <= v)
        a = m + 1;
      else
        b = m;
    }
    return a / this.total(s);
  }
  x(v) { return 40 + Math.log(v / this.lo) / Math.log(this.hi / this.lo) * (this.w - 54); }
  y(p) { return this.h - 24 - p * (this.h - 34); }
  draw() {
    const g = this.prepare(this.back);
    g.lineWidth = 1;
    g.textBaseline = 'middle';
    g.textAlign = 'right';
    for (const p of [0, 0.25, 0.5, 0.75, 0.95, 1]) {
      const y = Math.round(this.y(p)) + 0.5;
      g.strokeStyle = p === 0.95 ? C.line : C.grid;
      g.setLineDash(p === 0.95 ? [4, 3] : []);
      g.beginPath();
      g.moveTo(40, y);
      g.lineTo(this.w - 14, y);
      g.stroke();
      g.fillStyle = C.muted;
      if (p !== 0.95)
        g.fillText(p * 100 + ' %', 34, y);
      else
        g.fillText('95', 34, y + 3);
    }
    g.setLineDash([]);
    g.textAlign = 'center';
    g.textBaseline = 'alphabetic';
    for (let d = this.lo; d < this.hi * 1.01; d *= 10)
      for (const m of [1, 2, 5]) {
        const v = d * m;
        if (v > this.hi * 1.01) break;
        const x = Math.round(this.x(v)) + 0.5;
        g.strokeStyle = C.grid;
        g.beginPath();
        g.moveTo(x, this.y(1));
        g.lineTo(x, this.y(0));
        g.stroke();
        if (m === 1) {
          g.fillStyle = C.muted;
          g.fillText(axisMetres(v), Math.min(x, this.w - 20), this.h - 7);
        }
      }
    for (const s of this.sets) {
      g.strokeStyle = s[2]();
      g.lineWidth = 2;
      g.beginPath();
      const n = s[1].length, total = this.total(s);
      g.moveTo(this.x(Math.max(this.lo, s[1][0])), this.y(0));
      const stride = Math.max(1, Math.floor(n / 1500));
      for (let i = 0; i < n; i += stride) g.lineTo(this.x(Math.max(this.lo, s[1][i])), this.y((i + 1) / total));
      g.lineTo(this.x(Math.max(this.lo, s[1][n - 1])), this.y(n / total));
      g.stroke();
    }
    this.overlay();
  }
  overlay() {
    const g = this.prepare(this.front);
    if (!this.at) return;
    const x = Math.round(this.x(this.at)) + 0.5;
    g.strokeStyle = C.muted;
    g.beginPath();
    g.moveTo(x, this.y(1));
    g.lineTo(x, this.y(0));
    g.stroke();
  }
}

/* Sky: where each satellite was, how strong, and whether it was believed. */
const ramp = v => {
  const u = Math.max(0, Math.min(1, (v - 20) / 32));
  return 'hsl(' + (28 + 190 * u) + ' 70% ' + (54 - 8 * Math.abs(u - 0.5)) + '%)';
};
class SkyView extends Layers {
  constructor(host) {
    super(host, 286);
    this.front.addEventListener('pointermove', e => this.point(e));
    this.front.addEventListener('pointerleave', () => {
      this.at = null;
      hideTip();
      this.overlay();
    });
  }
  place(p) {
    const r = Math.min(this.w, this.h) / 2 - 16, d = (90 - p[1]) / 90 * r, a = p[0] * Math.PI / 180;
    return [this.w / 2 + d * Math.sin(a), this.h / 2 - d * Math.cos(a)];
  }
  draw() {
    const g = this.prepare(this.back), r = Math.min(this.w, this.h) / 2 - 16, x = this.w / 2, y = this.h / 2;
    g.strokeStyle = C.line;
    g.lineWidth = 1;
    for (const e of [0, 30, 60]) {
      g.beginPath();
      g.arc(x, y, r * (90 - e) / 90, 0, 6.2832);
      g.stroke();
    }
    g.strokeStyle = C.grid;
    for (let a = 0; a < 360; a += 45) {
      g.beginPath();
      g.moveTo(x, y);
      g.lineTo(x + r * Math.sin(a * Math.PI / 180), y - r * Math.cos(a * Math.PI / 180));
      g.stroke();
    }
    g.fillStyle = C.muted;
    g.textAlign = 'center';
    g.textBaseline = 'middle';
    [['N', 0, -1], ['E', 1, 0], ['S', 0, 1], ['W', -1, 0]].forEach(([n, a, b]) => g.fillText(n, x + a * (r + 9), y + b * (r + 9)));
    for (const e of [30, 60]) g.fillText(e + '°', x + r * (90 - e) / 90 * 0.71 + 8, y - r * (90 - e) / 90 * 0.71 - 4);
    for (const s of D.sky)
      for (const p of s.p) {
        const [a, b] = this.place(p), radius = 2.1 + (p[3] || 0) * 1.6;
        g.beginPath();
        g.arc(a, b, radius, 0, 6.2832);
        if ((p[3] || 0) > 0.5) {
          g.strokeStyle = C.status[3];
          g.lineWidth = 1.2;
          g.stroke();
        } else {
          g.fillStyle = ok(p[2]) ? ramp(p[2]) : C.accent;
          g.fill();
        }
      }
    g.textBaseline = 'alphabetic';
    g.font = '600 10px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif';
    g.lineWidth = 3;
    g.strokeStyle = C.card;
    g.fillStyle = C.ink;
    for (const s of D.sky) {
      const [a, b] = this.place(s.p[s.p.length - 1]);
      g.strokeText(s.n, a, b - 6);
      g.fillText(s.n, a, b - 6);
    }
    this.overlay();
  }
  point(e) {
    const r = this.box.getBoundingClientRect(), x = e.clientX - r.left, y = e.clientY - r.top;
    let best = null, limit = 144;
    for (const s of D.sky)
      for (const p of s.p) {
        const [a, b] = this.place(p), d = (a - x) ** 2 + (b - y) ** 2;
        if (d < limit) {
          limit = d;
          best = [s, p];
        }
      }
    this.at = best;
    this.overlay();
    if (!best) return hideTip();
    const p = best[1];
    showTip(e, best[0].n, [
      ['azimuth, elevation', p[0].toFixed(0) + '°, ' + p[1].toFixed(0) + '°'], ['C/N0', ok(p[2]) ? p[2].toFixed(1) + ' dB-Hz' : '–'],
      ['rejected', ok(p[3]) ? (100 * p[3]).toFixed(0) + ' %' : '–']
    ]);
  }
  overlay() {
    const g = this.prepare(this.front);
    if (!this.at) return;
    const [a, b] = this.place(this.at[1]);
    g.strokeStyle = C.ink;
    g.lineWidth = 2;
    g.beginPath();
    g.arc(a, b, 6, 0, 6.2832);
    g.stroke();
  }
}

/* Histogram of solve times. */
class HistogramView extends Layers {
  constructor(host, values) {
    super(host, 286);
    this.all = sorted(values).filter(v => v > 0);
    const s = this.all, hi = quantile(s, 0.995), lo = quantile(s, 0);
    this.lo = lo;
    this.hi = Math.max(hi, lo * 1.001 + 1e-6);
    this.bins = new Array(Math.max(8, Math.min(40, Math.ceil(Math.sqrt(s.length) * 1.5)))).fill(0);
    this.over = 0;
    for (const v of s) {
      const k = Math.floor((v - lo) / (this.hi - lo) * this.bins.length);
      if (k >= this.bins.length)
        v > this.hi ? ++this.over : ++this.bins[this.bins.length - 1];
      else
        ++this.bins[k];
    }
  }
  x(v) { return 44 + (v - this.lo) / (this.hi - this.lo) * (this.w - 62); }
  draw() {
    const g = this.prepare(this.back), peak = Math.max(...this.bins), y = n => this.h - 24 - n / peak * (this.h - 52),
          width = (this.w - 62) / this.bins.length;
    g.textBaseline = 'middle';
    g.textAlign = 'right';
    g.lineWidth = 1;
    for (const n of linearTicks(0, peak, 4)) {
      const b = Math.round(y(n)) + 0.5;
      g.strokeStyle = C.grid;
      g.beginPath();
      g.moveTo(44, b);
      g.lineTo(this.w - 18, b);
      g.stroke();
      g.fillStyle = C.muted;
      if (n === Math.round(n)) g.fillText(short(n), 38, b);
    }
    g.fillStyle = C.cat[0];
    this.bins.forEach((n, k) => {
      if (n) g.fillRect(44 + k * width + 0.5, y(n), Math.max(1, width - 1), this.h - 24 - y(n));
    });
    g.textBaseline = 'alphabetic';
    g.textAlign = 'center';
    g.fillStyle = C.muted;
    for (const v of linearTicks(this.lo, this.hi, 5)) g.fillText(short(v) + ' ms', this.x(v), this.h - 7);
    [['median', 0.5], ['95 %', 0.95]].forEach(([name, p], k) => {
      const v = quantile(this.all, p), x = Math.round(this.x(v)) + 0.5;
      g.strokeStyle = C.ink;
      g.setLineDash([3, 3]);
      g.beginPath();
      g.moveTo(x, 12 + 13 * k);
      g.lineTo(x, this.h - 24);
      g.stroke();
      g.setLineDash([]);
      g.fillStyle = C.ink;
      const right = x > this.w * 0.6;
      g.textAlign = right ? 'right' : 'left';
      g.fillText(name + ' ' + v.toPrecision(3) + ' ms', x + (right ? -5 : 5), 18 + 13 * k);
    });
  }
}
)js";

}  // namespace searvins::examples
