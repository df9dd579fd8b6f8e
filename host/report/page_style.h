// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace mf {

// The report's only style sheet: one column on a phone, up to three pictures a row on a desktop, light or dark as the
// reader's system has it.
inline constexpr std::string_view page_style = R"css(
:root { color-scheme: light dark; --ink: #1b1f24; --paper: #fff; --soft: #eef1f4; --line: #c9d0d8; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ed; --paper: #15181c; --soft: #22272d; --line: #444c56; } }
body { margin: 0 auto; max-width: 72rem; padding: 1rem; font: 16px/1.45 system-ui, sans-serif; color: var(--ink); background: var(--paper); }
h1 { font-size: 1.6rem; overflow-wrap: anywhere; } h2 { font-size: 1.2rem; margin: 2rem 0 .2rem; }
section > p { margin: .2rem 0 .8rem; max-width: 48rem; opacity: .85; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(10rem, 1fr)); gap: .6rem; }
.tile { background: var(--soft); border-radius: .5rem; padding: .6rem .8rem; }
.tile b { display: block; font-size: 1.15rem; } .tile span { font-size: .85rem; opacity: .85; }
.grid { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(46%, 18rem), 1fr)); gap: .8rem; }
.grid.wide { grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr)); align-items: start; }
figure { margin: 0; } figcaption { font-size: .85rem; opacity: .85; }
img, svg { display: block; width: 100%; height: auto; } img { image-rendering: auto; border-radius: .3rem; }
svg.frame polygon { fill: none; stroke: #00c8ff; stroke-width: 2; vector-effect: non-scaling-stroke; }
svg.chart { max-width: 56rem; font-size: 12px; } svg text { fill: var(--ink); }
svg .end { text-anchor: end; } svg .middle { text-anchor: middle; }
svg .grid { stroke: var(--line); stroke-width: .6; } svg polyline { fill: none; stroke-width: 1.6; }
svg .red { stroke: #d1495b; } svg .green { stroke: #3a9d5d; } svg .blue { stroke: #3b7dd8; } svg .ink { stroke: var(--ink); }
svg .bar { fill: #3b7dd8; } svg .missing { fill: #d1495b; opacity: .45; }
svg .emitter { fill: none; stroke: #fff; stroke-width: 1.5; paint-order: stroke; } svg text.emitter { fill: #fff; stroke: #000; font-size: 14px; }
svg .reference { stroke: var(--ink); stroke-dasharray: 5 4; }
table { border-collapse: collapse; font-size: .92rem; } td, th { text-align: left; padding: .2rem 1rem .2rem 0; border-bottom: 1px solid var(--line); }
)css";

}  // namespace mf
