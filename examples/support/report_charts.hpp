// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Scripts of report.html, second part: charts over time. A chart is two stacked canvases, the data and the cursor above it, because a
/// drive has tens of thousands of epochs and the cursor moves. Dense data are drawn per pixel column, from least to greatest, so that a
/// single bad epoch of an hour stays visible.
#pragma once

namespace searvins::examples {

inline constexpr const char* kReportCharts = R"js(
/* Two stacked canvases in a box of fixed height, sharp on any display. */
class Layers {
  constructor(host, height) {
    this.box = el('div', 'plot');
    if (height) this.box.style.height = height + 'px';
    host.append(this.box);
    this.back = el('canvas');
    this.front = el('canvas');
    this.box.append(this.back, this.front);
    this.timed = false;
    shared.charts.push(this);
    new ResizeObserver(() => this.draw()).observe(this.box);
  }
  prepare(canvas) {
    const r = Math.min(3, devicePixelRatio || 1), w = this.box.clientWidth, h = this.box.clientHeight;
    if (canvas.width !== Math.round(w * r) || canvas.height !== Math.round(h * r)) {
      canvas.width = Math.round(w * r);
      canvas.height = Math.round(h * r);
    }
    const g = canvas.getContext('2d');
    g.setTransform(r, 0, 0, r, 0, 0);
    g.clearRect(0, 0, w, h);
    g.font = '11px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif';
    g.lineJoin = 'round';
    this.w = w;
    this.h = h;
    return g;
  }
  draw() {}
  overlay() {}
}

/* A chart over time. Options: height; scale and its knee; range() -> [lo, hi]; ticks, a count or a list; format(v) of their labels;
   paint(chart); rows(i) -> lines of the readout; axis: false hides the times. */
class TimeChart extends Layers {
  constructor(host, options) {
    super(host, options.height || 120);
    this.timed = true;
    this.o = Object.assign({scale: 'linear', format: short, ticks: 4, axis: true, knee: 0.02, rows: () => []}, options);
    this.left = 58;
    this.right = 10;
    this.top = 6;
    this.bottom = this.o.axis ? 20 : 5;
    const f = this.front;
    let from = null;
    const time = e => {
      const x = e.clientX - this.box.getBoundingClientRect().left;
      return this.t(Math.max(this.left, Math.min(this.w - this.right, x)));
    };
    f.addEventListener('pointermove', e => {
      this.drag = from === null ? null : [from, time(e)];
      const i = nearestEpoch(time(e));
      setHover(i);
      this.overlay();
      showTip(e, 'sow ' + (D.sow + D.t[i]).toFixed(2) + '  ·  ' + clock(D.t[i], STEP < 1 ? 1 : 0), readout(i).concat(this.o.rows(i)));
    });
    f.addEventListener('pointerleave', () => {
      hideTip();
      setHover(-1);
    });
    f.addEventListener('pointerdown', e => {
      if (e.button === 0 && e.pointerType !== 'touch') {
        from = time(e);
        f.setPointerCapture(e.pointerId);
      }
    });
    f.addEventListener('pointerup', e => {
      if (from === null) return;
      const to = time(e), a = Math.min(from, to), b = Math.max(from, to);
      from = this.drag = null;
      if (this.x(b) - this.x(a) > 5)
        setSpan(a, b);
      else
        this.overlay();
    });
    f.addEventListener('dblclick', () => setSpan(...shared.full));
  }
  x(t) {
    const s = shared.span;
    return this.left + (t - s[0]) / (s[1] - s[0]) * (this.w - this.left - this.right);
  }
  t(x) {
    const s = shared.span;
    return s[0] + (x - this.left) / (this.w - this.left - this.right) * (s[1] - s[0]);
  }
  y(v) {
    const s = SCALES[this.o.scale], a = s.f(this.lo, this.o.knee), b = s.f(this.hi, this.o.knee);
    return this.h - this.bottom - (s.f(v, this.o.knee) - a) / (b - a) * (this.h - this.top - this.bottom);
  }
  visible() {
    let a = nearestEpoch(shared.span[0]), b = nearestEpoch(shared.span[1]);
    return [Math.max(0, a - 1), Math.min(N - 1, b + 1)];
  }
  draw() {
    const g = this.g = this.prepare(this.back);
    if (this.w < 50) return;
    [this.lo, this.hi] = this.o.range();
    if (!(this.hi > this.lo)) this.hi = this.lo + 1;
    const x0 = this.left, x1 = this.w - this.right, y0 = this.top, y1 = this.h - this.bottom;
    g.textBaseline = 'middle';
    g.textAlign = 'right';
    g.lineWidth = 1;
    const list = Array.isArray(this.o.ticks) ? this.o.ticks : scaleTicks(this.o.scale, this.lo, this.hi, this.o.ticks, this.o.knee),
          labelled = [];
    for (const v of [...list].sort(
             (a, b) => (b === 0) - (a === 0) || Math.abs(b) - Math.abs(a))) { /* zero and the largest keep their labels */
      const y = Math.round(this.y(v)) + 0.5;
      if (y < y0 - 1 || y > y1 + 1) continue;
      g.strokeStyle = v === 0 ? C.line : C.grid;
      g.beginPath();
      g.moveTo(x0, y);
      g.lineTo(x1, y);
      g.stroke();
      if (labelled.every(other => Math.abs(other - y) > 10)) {
        labelled.push(y);
        g.fillStyle = C.muted;
        g.fillText(this.o.format(v), x0 - 7, y);
      }
    }
    const times = timeTicks(shared.span[0], shared.span[1], (x1 - x0) / 110);
    g.textAlign = 'center';
    g.textBaseline = 'alphabetic';
    for (const t of times.out) {
      const x = Math.round(this.x(t)) + 0.5;
      g.strokeStyle = C.grid;
      g.beginPath();
      g.moveTo(x, y0);
      g.lineTo(x, y1);
      g.stroke();
      if (this.o.axis) {
        g.fillStyle = C.muted;
        if (x > x0 + 18 && x < x1 - 18) g.fillText(clock(t, times.step < 1 ? 1 : 0), x, this.h - 5);
      }
    }
    g.save();
    g.beginPath();
    g.rect(x0, y0 - 2, x1 - x0, y1 - y0 + 4);
    g.clip();
    for (const [from, to] of D.outages || []) {
      g.fillStyle = C.outage;
      g.fillRect(this.x(from), y0, Math.max(1, this.x(to) - this.x(from)), y1 - y0);
    }
    this.o.paint(this);
    g.restore();
    this.overlay();
  }
  overlay() {
    const g = this.prepare(this.front);
    if (this.drag) {
      g.fillStyle = C.select;
      const a = this.x(this.drag[0]), b = this.x(this.drag[1]);
      g.fillRect(Math.min(a, b), this.top, Math.abs(b - a), this.h - this.top - this.bottom);
    }
    if (shared.hover < 0) return;
    const x = Math.round(this.x(D.t[shared.hover])) + 0.5;
    if (x < this.left || x > this.w - this.right) return;
    g.strokeStyle = C.muted;
    g.lineWidth = 1;
    g.beginPath();
    g.moveTo(x, this.top);
    g.lineTo(x, this.h - this.bottom);
    g.stroke();
  }
  /* A line through the values that exist, broken at gaps. */
  line(values, color, width = 1.4) {
    const g = this.g, [a, b] = this.visible(), dense = b - a > 2 * (this.w - this.left - this.right);
    g.strokeStyle = color;
    g.lineWidth = width;
    g.beginPath();
    let last = -1, column = -1e9, low = 0, high = 0;
    const flush = () => {
      if (column > -1e8) {
        g.moveTo(column + 0.5, low - 0.5);
        g.lineTo(column + 0.5, high + 0.5);
      }
    };
    for (let i = a; i <= b; ++i) {
      if (!ok(values[i])) continue;
      const x = this.x(D.t[i]), y = this.y(values[i]);
      if (dense) {
        const c = Math.round(x);
        if (c !== column) {
          flush();
          low = high = y;
          if (last >= 0 && c - column < 3) {
            low = Math.min(low, this.last);
            high = Math.max(high, this.last);
          }
          column = c;
        }
        low = Math.min(low, y);
        high = Math.max(high, y);
        this.last = y;
      } else if (last < 0 || D.t[i] - D.t[last] > 3.5 * STEP)
        g.moveTo(x, y);
      else
        g.lineTo(x, y);
      last = i;
    }
    flush();
    g.stroke();
  }
  /* A dot an epoch, coloured by color(i); the worst status is drawn last. Dots that would fall on one another are drawn once. */
  dots(values, color, radius = 1.7, order = null) {
    const g = this.g, [a, b] = this.visible(), groups = new Map();
    for (let i = a; i <= b; ++i) {
      if (!ok(values[i])) continue;
      const c = color(i);
      if (!groups.has(c)) groups.set(c, []);
      groups.get(c).push(i);
    }
    const keys = order ? order.filter(c => groups.has(c)) : [...groups.keys()];
    const r = b - a > 4000 ? Math.min(radius, 1.3) : b - a < 150 ? radius + 0.7 : radius;
    for (const c of keys) {
      const seen = new Set();
      g.fillStyle = c;
      g.beginPath();
      for (const i of groups.get(c)) {
        const x = this.x(D.t[i]), y = this.y(values[i]), key = Math.round(x) * 8192 + Math.round(y);
        if (seen.has(key)) continue;
        seen.add(key);
        g.moveTo(x + r, y);
        g.arc(x, y, r, 0, 6.2832);
      }
      g.fill();
    }
  }
  /* A dashed line at one value. */
  mark(value, color) {
    const g = this.g, y = Math.round(this.y(value)) + 0.5;
    g.strokeStyle = color;
    g.lineWidth = 1;
    g.setLineDash([4, 3]);
    g.beginPath();
    g.moveTo(this.left, y);
    g.lineTo(this.w - this.right, y);
    g.stroke();
    g.setLineDash([]);
  }
  /* The whole width between two values. */
  stripe(low, high, color) {
    const g = this.g, a = this.y(high), b = this.y(low);
    g.fillStyle = color;
    g.fillRect(this.left, a, this.w - this.left - this.right, b - a);
  }
  /* The area between two series. */
  band(low, high, color) {
    const g = this.g, [a, b] = this.visible(), dense = b - a > 2 * (this.w - this.left - this.right);
    g.fillStyle = color;
    let run = [];
    const flush = () => {
      if (run.length) {
        g.beginPath();
        run.forEach((p, k) => k ? g.lineTo(p[0], p[1]) : g.moveTo(p[0], p[1]));
        for (let k = run.length - 1; k >= 0; --k) g.lineTo(run[k][0], run[k][2]);
        g.closePath();
        g.fill();
      }
      run = [];
    };
    let last = -1;
    for (let i = a; i <= b; ++i) {
      if (!ok(low[i]) || !ok(high[i])) {
        flush();
        last = -1;
        continue;
      }
      if (last >= 0 && D.t[i] - D.t[last] > 3.5 * STEP) flush();
      const x = dense ? Math.round(this.x(D.t[i])) : this.x(D.t[i]), p = [x, this.y(low[i]), this.y(high[i])], q = run[run.length - 1];
      if (dense && q && q[0] === x) {
        q[1] = Math.max(q[1], p[1]);
        q[2] = Math.min(q[2], p[2]);
      } else
        run.push(p);
      last = i;
    }
    flush();
  }
  /* Bars an epoch wide, stacked. */
  stack(series, colors) {
    const g = this.g, [a, b] = this.visible(), columns = new Map();
    for (let i = a; i <= b; ++i) {
      const x0 = Math.floor(this.x(D.t[i] - STEP / 2)), x1 = Math.max(x0 + 1, Math.floor(this.x(D.t[i] + STEP / 2)));
      let total = 0;
      for (const s of series) total += s[i] || 0;
      if (!total) continue;
      const old = columns.get(x0);
      if (!old || old[1] < total) columns.set(x0, [i, total, x1]);
    }
    for (const [x, [i, , x1]] of columns) {
      let sum = 0;
      series.forEach((s, k) => {
        const v = s[i] || 0;
        if (!v) return;
        const y0 = this.y(sum), y1 = this.y(sum + v);
        g.fillStyle = colors[k % colors.length];
        g.fillRect(x, y1, x1 - x, y0 - y1);
        sum += v;
      });
    }
  }
  /* A ribbon of categories: where several epochs fall into one pixel it is divided by their shares. */
  ribbon(values, colors) {
    const g = this.g, [a, b] = this.visible(), y0 = this.top, height = this.h - this.top - this.bottom, cells = new Map();
    for (let i = a; i <= b; ++i) {
      if (!ok(values[i]) || values[i] < 0) continue;
      const x0 = Math.floor(this.x(D.t[i] - STEP / 2)), x1 = Math.max(x0, Math.floor(this.x(D.t[i] + STEP / 2)) - 1);
      for (let x = x0; x <= x1; ++x) {
        let c = cells.get(x);
        if (!c) cells.set(x, c = new Uint16Array(colors.length));
        ++c[values[i]];
      }
    }
    for (const [x, c] of cells) {
      let total = 0, y = y0;
      for (const n of c) total += n;
      c.forEach((n, k) => {
        if (n) {
          const h = height * n / total;
          g.fillStyle = colors[k];
          g.fillRect(x, y, 1, h);
          y += h;
        }
      });
    }
  }
}
)js";

}  // namespace searvins::examples
