// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Scripts of report.html, third part: the track seen from above, east to the right, with the truth below it, a scale bar, zoom and pan.
#pragma once

namespace searvins::examples {

inline constexpr const char* kReportMap = R"js(
/* The track seen from above, east to the right. */
class MapView extends Layers {
  constructor(host) {
    super(host, 0);
    this.box.id = 'map';
    this.shown = [true, true, true, true, true];
    this.fit();
    const f = this.front;
    let grab = null;
    f.tabIndex = 0;
    f.addEventListener('pointerdown', e => {
      grab = [e.clientX, e.clientY];
      f.setPointerCapture(e.pointerId);
      this.box.classList.add('drag');
      f.focus({preventScroll: true});
    });
    f.addEventListener('pointerup', () => {
      grab = null;
      this.box.classList.remove('drag');
    });
    f.addEventListener('pointermove', e => {
      if (grab) {
        this.cx -= (e.clientX - grab[0]) / this.scale;
        this.cy += (e.clientY - grab[1]) / this.scale;
        grab = [e.clientX, e.clientY];
        this.touched = true;
        return this.draw();
      }
      const r = this.box.getBoundingClientRect(), i = this.nearest(e.clientX - r.left, e.clientY - r.top);
      setHover(i);
      if (i < 0) return hideTip();
      const rows = readout(i);
      if (D.h && ok(D.h[i])) rows.push(['horizontal error', metres(D.h[i])]);
      if (D.se && ok(D.se[i])) rows.push(['1-sigma E, N', metres(D.se[i]) + ', ' + metres(D.sn[i])]);
      showTip(e, 'sow ' + (D.sow + D.t[i]).toFixed(2) + '  ·  ' + clock(D.t[i]), rows);
    });
    f.addEventListener('pointerleave', () => {
      hideTip();
      setHover(-1);
    });
    f.addEventListener('dblclick', e => {
      const r = this.box.getBoundingClientRect();
      this.zoom(2, e.clientX - r.left, e.clientY - r.top);
    });
    f.addEventListener('wheel', e => {
      if (!e.ctrlKey && document.activeElement !== f) return;
      e.preventDefault();
      const r = this.box.getBoundingClientRect();
      this.zoom(Math.exp(-e.deltaY * 0.0015), e.clientX - r.left, e.clientY - r.top);
    }, {passive: false});
  }
  fit(only = -1) {
    const pick = (a, truth) => {
      const v = [];
      for (let i = 0; i < N; ++i)
        if (ok(a[i]) && (only < 0 || D.s[i] === only)) v.push(a[i]);
      const s = sorted(v), q = N > 60 ? 0.004 : 0;
      let lo = quantile(s, q), hi = quantile(s, 1 - q);
      if (only < 0 && truth && truth.length) {
        lo = Math.min(lo, ...this.ends(truth));
        hi = Math.max(hi, ...this.ends(truth));
      }
      return [lo, hi];
    };
    [this.e0, this.e1] = pick(D.e, D.truth && D.truth.e);
    [this.n0, this.n1] = pick(D.n, D.truth && D.truth.n);
    this.touched = false;
  }
  ends(a) {
    let lo = Infinity, hi = -Infinity;
    for (const v of a) {
      if (v < lo) lo = v;
      if (v > hi) hi = v;
    }
    return [lo, hi];
  }
  zoom(k, x = this.w / 2, y = this.h / 2) {
    const e = this.cx + (x - this.w / 2) / this.scale, n = this.cy - (y - this.h / 2) / this.scale;
    this.scale = Math.max(1e-3, Math.min(1e6, this.scale * k));
    this.cx = e - (x - this.w / 2) / this.scale;
    this.cy = n + (y - this.h / 2) / this.scale;
    this.touched = true;
    this.draw();
  }
  X(e) { return this.w / 2 + (e - this.cx) * this.scale; }
  Y(n) { return this.h / 2 - (n - this.cy) * this.scale; }
  nearest(x, y) {
    let best = -1, limit = 14 * 14;
    for (let i = 0; i < N; ++i) {
      if (!this.shown[D.s[i]] || !ok(D.e[i])) continue;
      const d = (this.X(D.e[i]) - x) ** 2 + (this.Y(D.n[i]) - y) ** 2;
      if (d < limit) {
        limit = d;
        best = i;
      }
    }
    return best;
  }
  /* Streets as bands of eight metres, at least three pixels. */
  streets(g) {
    if (!D.streets) return;
    g.strokeStyle = C.grid;
    g.lineWidth = Math.max(3, 8 * this.scale);
    g.lineCap = g.lineJoin = 'round';
    for (const s of D.streets) {
      g.beginPath();
      s.e.forEach((e, i) => i ? g.lineTo(this.X(e), this.Y(s.n[i])) : g.moveTo(this.X(e), this.Y(s.n[i])));
      g.stroke();
    }
    g.lineCap = 'butt';
    g.lineJoin = 'miter';
  }
  draw() {
    const g = this.prepare(this.back);
    if (this.w < 50) return;
    if (!this.touched) {
      const margin = 46;
      this.cx = (this.e0 + this.e1) / 2;
      this.cy = (this.n0 + this.n1) / 2;
      this.scale =
          Math.min((this.w - 2 * margin) / Math.max(0.02, this.e1 - this.e0), (this.h - 2 * margin) / Math.max(0.02, this.n1 - this.n0));
    }
    const step = niceStep(this.w / this.scale, 8);
    g.strokeStyle = C.grid;
    g.lineWidth = 1;
    g.beginPath();
    for (let v = Math.ceil((this.cx - this.w / 2 / this.scale) / step) * step, x; (x = this.X(v)) < this.w; v += step) {
      g.moveTo(Math.round(x) + 0.5, 0);
      g.lineTo(Math.round(x) + 0.5, this.h);
    }
    for (let v = Math.ceil((this.cy - this.h / 2 / this.scale) / step) * step, y; (y = this.Y(v)) > 0; v += step) {
      g.moveTo(0, Math.round(y) + 0.5);
      g.lineTo(this.w, Math.round(y) + 0.5);
    }
    g.stroke();
    this.streets(g);
    const inside = (x, y) => x > -50 && y > -50 && x < this.w + 50 && y < this.h + 50;
    if (D.truth) {
      if (D.truth.e.length === 1) {
        const x = this.X(D.truth.e[0]), y = this.Y(D.truth.n[0]);
        g.strokeStyle = C.truth;
        g.lineWidth = 1.5;
        g.beginPath();
        g.moveTo(x - 9, y);
        g.lineTo(x + 9, y);
        g.moveTo(x, y - 9);
        g.lineTo(x, y + 9);
        g.stroke();
      } else {
        g.strokeStyle = C.truth;
        g.globalAlpha = 0.55;
        g.lineWidth = 1.4;
        g.beginPath();
        let pen = false;
        for (let i = 0; i < D.truth.e.length; ++i) {
          if (!ok(D.truth.e[i])) {
            pen = false;
            continue;
          }
          const x = this.X(D.truth.e[i]), y = this.Y(D.truth.n[i]);
          pen ? g.lineTo(x, y) : g.moveTo(x, y);
          pen = true;
        }
        g.stroke();
        g.globalAlpha = 1;
      }
    }
    for (const s of [4, 3, 2, 1, 0]) { /* the best on top */
      if (!this.shown[s]) continue;
      g.strokeStyle = g.fillStyle = C.status[s];
      g.lineWidth = 1.6;
      g.globalAlpha = 0.5;
      g.beginPath();
      for (let i = 1; i < N; ++i)
        if (D.s[i] === s && ok(D.e[i]) && ok(D.e[i - 1]) && D.t[i] - D.t[i - 1] < 3.5 * STEP) {
          const x0 = this.X(D.e[i - 1]), y0 = this.Y(D.n[i - 1]), x1 = this.X(D.e[i]), y1 = this.Y(D.n[i]);
          if (inside(x0, y0) || inside(x1, y1)) {
            g.moveTo(x0, y0);
            g.lineTo(x1, y1);
          }
        }
      g.stroke();
      g.globalAlpha = 1;
      g.beginPath();
      const seen = new Set(), r = N > 3000 ? 1.9 : 2.6;
      for (let i = 0; i < N; ++i) {
        if (D.s[i] !== s || !ok(D.e[i])) continue;
        const x = this.X(D.e[i]), y = this.Y(D.n[i]);
        if (!inside(x, y)) continue;
        const key = Math.round(x) * 8192 + Math.round(y);
        if (seen.has(key)) continue;
        seen.add(key);
        g.moveTo(x + r, y);
        g.arc(x, y, r, 0, 6.2832);
      }
      g.fill();
    }
    const length = niceStep(140 / this.scale, 1) * (niceStep(140 / this.scale, 1) * this.scale > 190 ? 0.5 : 1), px = length * this.scale,
          y = this.h - 18;
    g.fillStyle = C.card;
    g.globalAlpha = 0.85;
    g.fillRect(10, y - 20, px + 20, 32);
    g.globalAlpha = 1;
    g.strokeStyle = C.ink;
    g.lineWidth = 1.5;
    g.beginPath();
    g.moveTo(20, y - 4);
    g.lineTo(20, y);
    g.lineTo(20 + px, y);
    g.lineTo(20 + px, y - 4);
    g.stroke();
    g.fillStyle = C.ink;
    g.textAlign = 'center';
    g.textBaseline = 'alphabetic';
    g.fillText(axisMetres(length).replace(/^(\d+)000 m$/, '$1 km'), 20 + px / 2, y - 7);
    g.fillText('N', this.w - 22, 20);
    g.beginPath();
    g.moveTo(this.w - 22, 24);
    g.lineTo(this.w - 27, 38);
    g.lineTo(this.w - 22, 35);
    g.lineTo(this.w - 17, 38);
    g.closePath();
    g.fill();
    this.overlay();
  }
  overlay() {
    const g = this.prepare(this.front), i = shared.hover;
    if (i < 0 || !ok(D.e[i])) return;
    const x = this.X(D.e[i]), y = this.Y(D.n[i]);
    g.strokeStyle = C.ink;
    g.lineWidth = 2;
    g.beginPath();
    g.arc(x, y, 7, 0, 6.2832);
    g.stroke();
    if (D.se && ok(D.se[i]) && D.cen && ok(D.cen[i])) { /* 95 % ellipse: 2.448 sigma */
      const a = D.se[i] ** 2, b = D.sn[i] ** 2, c = D.cen[i], m = (a + b) / 2, d = Math.hypot((a - b) / 2, c),
            turn = -Math.atan2(c, (a - b) / 2) / 2;
      g.strokeStyle = C.accent;
      g.lineWidth = 1.2;
      g.beginPath();
      g.ellipse(x, y, 2.448 * Math.sqrt(m + d) * this.scale, 2.448 * Math.sqrt(Math.max(0, m - d)) * this.scale, turn, 0, 6.2832);
      g.stroke();
    }
  }
}
)js";

}  // namespace searvins::examples
