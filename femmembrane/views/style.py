"""The style sheet of a page: one column on a phone, two on a screen, light and dark as the reader has it."""

STYLE = """
:root { --ink: #1d2126; --soft: #5b6570; --paper: #ffffff; --page: #f3f5f7; --line: #d9dee3; --accent: #0b63a5;
  --good: #0a6b4b; --bad: #a8324a; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ec; --soft: #a3adb7; --paper: #1a1d21; --page: #101215; --line: #343a41;
  --accent: #7cc0f5; --good: #5fd0a5; --bad: #ff8fa3; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1120px; padding: 0 16px 48px; background: var(--page); color: var(--ink);
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; overflow-wrap: anywhere; }
header { padding: 28px 0 4px; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0 0 8px; }
h2 { font-size: 1.15rem; margin: 0 0 12px; }
h3 { font-size: .85rem; margin: 14px 0 4px; color: var(--soft); font-weight: 600; }
p { margin: 8px 0; max-width: 75ch; }
nav { display: flex; flex-wrap: wrap; gap: 4px 16px; margin: 16px 0; font-size: .9rem; }
a { color: var(--accent); }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 18px; margin: 16px 0;
  scroll-margin-top: 8px; }
.badge { display: inline-block; margin: 0; padding: 1px 12px; border-radius: 99px; border: 1px solid currentColor; font-size: .85rem;
  font-weight: 600; }
.good, .stable { color: var(--good); } .bad, .unstable { color: var(--bad); } .marginal { color: var(--soft); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 10px; margin: 14px 0; }
.tile { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 10px 14px; }
.tile b { display: block; font-size: 1.05rem; font-variant-numeric: tabular-nums; } .tile span { color: var(--soft); font-size: .8rem; }
.figures > * { min-width: 0; }
.figures > .wide { grid-column: 1 / -1; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); gap: 20px; align-items: start; }
figure { margin: 0; min-width: 0; max-width: 620px; } figure svg { display: block; width: 100%; height: auto; fill: var(--ink); }
.figures > div > figure + figure { margin-top: 18px; }
figcaption { color: var(--soft); font-size: .85rem; margin-top: 4px; }
.scroll { overflow-x: auto; margin: 12px 0; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; color: var(--soft); padding-bottom: 6px; }
th, td { text-align: left; padding: 4px 14px 4px 0; border-bottom: 1px solid var(--line); vertical-align: top; white-space: nowrap; }
th { color: var(--soft); font-weight: 600; } .number { text-align: right; }
td.bar { width: 220px; padding-top: 9px; } td.bar i { display: block; height: 10px; min-width: 1px; border-radius: 3px;
  background: var(--accent); }
dl { display: grid; grid-template-columns: minmax(7rem, max-content) 1fr; gap: 2px 16px; margin: 6px 0; font-size: .9rem; }
dt { color: var(--soft); } dd { margin: 0; min-width: 0; font-variant-numeric: tabular-nums; }
.columns { columns: 2 380px; column-gap: 36px; } .columns > div { break-inside: avoid; padding-bottom: 6px; }
.columns h3:first-child { margin-top: 0; }
pre { overflow-x: auto; margin: 0; font-size: .8rem; line-height: 1.4; }
summary { cursor: pointer; color: var(--accent); }
@media (max-width: 480px) { section { padding: 14px 12px; } body { padding: 0 10px 32px; } h1 { font-size: 1.35rem; }
  dl { grid-template-columns: 1fr; gap: 0; } dd { margin-bottom: 6px; }
  .scene dl { grid-template-columns: minmax(7rem, max-content) 1fr; gap: 0 14px; } }
@media print { body { background: none; } section { break-inside: avoid; border: none; padding: 0; } nav { display: none; } }
""".strip()
