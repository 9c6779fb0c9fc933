// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The look of report.html: one style sheet for light and dark, screen and paper. No external fonts, no external anything.
#pragma once

namespace searvins::examples {

inline constexpr const char* kReportStyle = R"css(
:root {
  color-scheme: light dark;
  --page: #f5f6f8; --card: #ffffff; --ink: #1b1f24; --muted: #66707c; --line: #dfe3e8; --grid: #eceff2; --accent: #2563c9;
  --band: rgba(37, 99, 201, 0.13); --truth: #30363d; --select: rgba(37, 99, 201, 0.15); --shade: #f0f2f5; --outage: rgba(212, 51, 79, 0.11);
  --fix: #17914a; --float: #ee8a0e; --dgnss: #2f7de1; --spp: #d4334f; --dr: #8b929c;
  --c0: #3b76b8; --c1: #e8833a; --c2: #c94f5c; --c3: #4fa3a0; --c4: #6d9b3c; --c5: #c9a227; --c6: #9467bd; --c7: #8c6d5b;
}
@media (prefers-color-scheme: dark) {
  :root {
    --page: #111418; --card: #191d23; --ink: #e6e9ed; --muted: #98a2ae; --line: #2c333c; --grid: #232930; --accent: #6ea8fe;
    --band: rgba(110, 168, 254, 0.17); --truth: #d5dae0; --select: rgba(110, 168, 254, 0.2); --shade: #20262d; --outage: rgba(255, 102, 129, 0.16);
    --fix: #35c06d; --float: #ffa53d; --dgnss: #62a5ff; --spp: #ff6681; --dr: #8f98a3;
    --c0: #6ea6e0; --c1: #f5a062; --c2: #ec7f8a; --c3: #74c7c3; --c4: #9cc96a; --c5: #e3c15a; --c6: #b996db; --c7: #b99c8b;
  }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 14px/1.45 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif;
  font-variant-numeric: tabular-nums; -webkit-text-size-adjust: 100%; }
main { max-width: 1320px; margin: 0 auto; padding: 28px 24px 48px; }
header { margin-bottom: 20px; }
.over { color: var(--muted); font-size: 12px; letter-spacing: 0.08em; text-transform: uppercase; }
h1 { font-size: 27px; line-height: 1.2; font-weight: 650; margin: 2px 0 4px; letter-spacing: -0.01em; overflow-wrap: anywhere; }
h2 { font-size: 15px; font-weight: 650; margin: 0; }
.sub { color: var(--muted); margin: 0; }
code { font: 12px/1.5 ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; overflow-wrap: anywhere; }
.command { margin: 10px 0 0; padding: 7px 10px; background: var(--shade); border-radius: 6px; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(128px, 1fr)); gap: 12px; margin: 18px 0; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: 11px 12px 10px; }
.tile b { display: block; font-size: 23px; line-height: 1.25; font-weight: 640; letter-spacing: -0.01em; white-space: nowrap; }
.tile b small { font-size: 13px; font-weight: 500; color: var(--muted); margin-left: 3px; letter-spacing: 0; }
.tile span { color: var(--muted); font-size: 12px; }
.tile.good b { color: var(--fix); } .tile.bad b { color: var(--spp); }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: 14px 16px; margin-bottom: 16px;
  min-width: 0; }
.head { display: flex; flex-wrap: wrap; align-items: baseline; gap: 4px 16px; margin-bottom: 8px; }
.head .note { color: var(--muted); font-size: 12px; }
.legend { display: flex; flex-wrap: wrap; gap: 2px 13px; margin-left: auto; font-size: 12px; color: var(--muted); }
.legend i { display: inline-block; width: 10px; height: 10px; border-radius: 3px; margin-right: 5px; vertical-align: -1px; }
.legend i.thin { height: 3px; vertical-align: 3px; }
.columns { display: grid; grid-template-columns: minmax(0, 1fr) 384px; gap: 16px; align-items: stretch; }
.columns > .card { margin-bottom: 16px; }
.three { display: grid; grid-template-columns: repeat(auto-fit, minmax(370px, 1fr)); gap: 16px; }
.plot { position: relative; width: 100%; }
.plot canvas { position: absolute; inset: 0; width: 100%; height: 100%; display: block; }
.plot canvas + canvas { cursor: crosshair; touch-action: pan-y; }
#map { height: 100%; min-height: 500px; }
#map canvas + canvas { cursor: grab; } #map.drag canvas + canvas { cursor: grabbing; }
.mapcard { display: flex; flex-direction: column; } .mapcard .grow { flex: 1; min-height: 500px; }
.panel + .panel { margin-top: 12px; padding-top: 10px; border-top: 1px solid var(--grid); }
.panel h3 { font-size: 13px; font-weight: 620; margin: 0; }
.buttons { display: inline-flex; gap: 4px; }
button { font: inherit; font-size: 12px; color: var(--ink); background: var(--shade); border: 1px solid var(--line);
  border-radius: 6px; padding: 2px 9px; cursor: pointer; }
button:hover { border-color: var(--muted); } button[aria-pressed=true] { background: var(--accent); border-color: var(--accent);
  color: var(--card); }
table { border-collapse: collapse; width: 100%; font-size: 13px; }
td, th { text-align: left; padding: 4px 0; border-bottom: 1px solid var(--grid); font-weight: 400; vertical-align: top; }
td:last-child { text-align: right; white-space: nowrap; padding-left: 12px; } tr:last-child td, tr:last-child th { border-bottom: 0; }
th { color: var(--muted); }
td.wrap { white-space: normal; overflow-wrap: anywhere; }
caption { text-align: left; font-weight: 650; padding: 0 0 4px; } table + table { margin-top: 16px; }
.runs td, .runs th { text-align: right; white-space: nowrap; padding-left: 14px; }
.runs td:first-child, .runs th:first-child { text-align: left; padding-left: 0; }
.runs i { display: inline-block; width: 10px; height: 10px; border-radius: 3px; margin-right: 7px; }
.runs.list td:nth-last-child(-n+2), .runs.list th:nth-last-child(-n+2) { text-align: left; }
.runs b.over-share { color: var(--spp); font-weight: 640; }
.runs.paper th { vertical-align: bottom; } .runs.paper tr:nth-child(2) th:first-child { text-align: right; padding-left: 14px; } .runs.paper th.group { text-align: center; border-bottom: 1px solid var(--line); }
.runs tr.of-paper td { color: var(--muted); } .runs td small { margin-left: 7px; color: var(--muted); }
.integrity h3, summary { font-size: 13px; font-weight: 620; margin: 16px 0 2px; } .integrity .head + h3 { margin-top: 4px; }
summary { cursor: pointer; }
.scroll { overflow-x: auto; }
.share { display: flex; height: 12px; border-radius: 4px; overflow: hidden; margin: 4px 0 8px; background: var(--grid); }
.share i { display: block; height: 100%; }
.notes { margin: 0; padding-left: 18px; } .notes li { margin: 3px 0; }
.settings { columns: 3 320px; column-gap: 32px; } .settings table { break-inside: avoid; }
.strip { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 460px), 1fr)); gap: 16px; }
.strip figure { margin: 0; min-width: 0; break-inside: avoid; }
.strip img { display: block; width: 100%; height: auto; border-radius: 6px; background: #000; }
.strip figcaption { display: flex; flex-wrap: wrap; gap: 0 12px; padding: 5px 2px 0; font-size: 12px; }
.strip figcaption b { font-weight: 620; } .strip figcaption .count { margin-left: auto; }
.strip figcaption small { flex-basis: 100%; font-size: 12px; color: var(--muted); }
.marks { display: flex; flex-wrap: wrap; gap: 4px 16px; margin: 0 0 10px; font-size: 12px; color: var(--muted); }
.marks svg { width: 15px; height: 15px; margin-right: 5px; vertical-align: -3px; }
.marks i { display: inline-block; width: 64px; height: 9px; border-radius: 3px; vertical-align: -1px; }
#tip { position: fixed; z-index: 9; pointer-events: none; background: var(--card); border: 1px solid var(--line); border-radius: 7px;
  padding: 6px 9px; font-size: 12px;
  box-shadow: 0 4px 16px rgba(0, 0, 0, 0.16); display: none; white-space: nowrap; max-width: 320px; }
#tip b { display: block; margin-bottom: 2px; font-weight: 620; } #tip div { display: flex; justify-content: space-between; gap: 14px; }
#tip i { display: inline-block; width: 8px; height: 8px; border-radius: 2px; margin-right: 5px; }
footer { color: var(--muted); font-size: 12px; }
@media (max-width: 1000px) { .columns { grid-template-columns: minmax(0, 1fr); } main { padding: 18px 12px; } .legend { margin-left: 0; } }
@media print { :root { --page: #fff; } .card, .tile { break-inside: avoid; } .buttons, .hint { display: none; } }
)css";

}  // namespace searvins::examples
