
"use strict";
// Shows what /events tells. Only text nodes and canvases are written: nothing that the rig says is taken for markup.

const byId = (id) => document.getElementById(id);
let latest = null;       // the last status event
let heard = 0;           // when it came, ms
let preview = null;      // the last picture; it may be missing from later statuses
let mosaic = null;       // which patch each pixel of the hemisphere belongs to; made anew when the patches are others

// Screen readers speak what changes, so what stays is not written again.
function say(id, text) {
  const node = byId(id);
  if (node.textContent !== text) node.textContent = text;
}

function known(value) { return typeof value === "number" && isFinite(value); }
function grouped(n) { return String(Math.round(n)).replace(/\B(?=(\d{3})+$)/g, "\u2009"); }
function bytes(n) { return n >= 1e11 ? grouped(n / 1e9) + " GB" : n >= 1e9 ? (n / 1e9).toFixed(1) + " GB" : grouped(n / 1e6) + " MB"; }
function clock(s) {
  const whole = Math.floor(s), pad = (n) => String(n).padStart(2, "0");
  return whole >= 3600 ? Math.floor(whole / 3600) + ":" + pad(Math.floor(whole / 60) % 60) + ":" + pad(whole % 60)
                       : Math.floor(whole / 60) + ":" + pad(whole % 60);
}
function exposure(s) { return s >= 1 ? s.toFixed(1) + " s" : s >= 1e-3 ? (s * 1e3).toPrecision(3) + " ms" : (s * 1e6).toPrecision(3) + " µs"; }
function minutes(s) { return s < 90 ? Math.floor(s) + " s" : s < 36000 ? Math.floor(s / 60) + " min" : Math.floor(s / 3600) + " h"; }

const titles = { idle: "READY", metering: "METERING", recording: "RECORDING", done: "DONE", error: "ERROR" };

// The clock stands by itself: it changes every second, and is not to be spoken each time.
function banner(state, title, detail, time) {
  byId("banner").dataset.state = state;
  say("state", title);
  say("detail", detail);
  say("clock", time || "");
  const full = title + " – Mirrorfield";
  if (document.title !== full) document.title = full;
}

function bannerOf(s) {
  const time = s.seconds > 0 && s.state !== "idle" ? clock(s.seconds) : "";
  const enough = s.coverage && s.coverage.done;
  const details = { idle: "Press the button", metering: "Hold the mirror still in the picture",
                    recording: enough ? "You may stop: hold the button" : "Move the mirror",
                    done: grouped(s.durable_frames) + " frames, all safe", error: "" };
  banner(s.state, titles[s.state], details[s.state], time);
}

function numbers(s) {
  say("frames", grouped(s.durable_frames));
  say("rate", known(s.frame_rate_hz) && s.frame_rate_hz > 0 ? s.frame_rate_hz.toFixed(1) + " /s" : "–");
  const lossy = s.lost_frames > 0 || s.gaps > 0;
  say("lost", lossy ? grouped(s.lost_frames) + " in " + grouped(s.gaps) + (s.gaps === 1 ? " gap" : " gaps") : "none");
  byId("lost-row").className = lossy ? "alarm" : "";
  say("queue", s.queue_frames > 0 ? s.queued + " of " + s.queue_frames : "–");
  byId("queue").parentNode.className = s.queue_frames > 0 && s.queued > s.queue_frames / 2 ? "alarm" : "";
  say("free", bytes(s.free_bytes));
  say("left", known(latest.seconds_left) ? minutes(latest.seconds_left) : "–");
  byId("left").parentNode.className = known(latest.seconds_left) && latest.seconds_left < 300 ? "alarm" : "";
  say("exposure", known(s.exposure_s) && s.exposure_s > 0 ? exposure(s.exposure_s) : "–");
  say("temperature", known(s.temperature_c) ? Math.round(s.temperature_c) + " °C" : "–");
  say("camera", s.camera);
  say("session", s.session);
}

// The hemisphere from above, equal areas for equal solid angles: the zenith in the middle, the horizon at the rim,
// the plane's x to the right and y up.
const size = 640, middle = size / 2, radius = 262;
function place(azimuth_deg, elevation_deg) {
  const away = radius * Math.sqrt(Math.max(0, 1 - Math.sin(elevation_deg * Math.PI / 180)));
  const turn = azimuth_deg * Math.PI / 180;
  return [middle + away * Math.cos(turn), middle - away * Math.sin(turn)];
}

// Every pixel belongs to the patch whose centre is nearest to it on the sphere.
function mosaicOf(patches) {
  const key = patches.map((p) => p[0] + "," + p[1]).join(";");
  if (mosaic && mosaic.key === key) return mosaic;
  const unit = (az, el) => [Math.cos(el) * Math.cos(az), Math.cos(el) * Math.sin(az), Math.sin(el)];
  const centres = patches.map((p) => unit(p[0] * Math.PI / 180, p[1] * Math.PI / 180));
  const half = size / 2, owner = new Int32Array(half * half).fill(-1);
  for (let y = 0; y < half; ++y)
    for (let x = 0; x < half; ++x) {
      const dx = (2 * x + 1 - middle) / radius, dy = (middle - 2 * y - 1) / radius, away2 = dx * dx + dy * dy;
      if (away2 > 1) continue;
      const up = 1 - away2, level = Math.sqrt(Math.max(0, 1 - up * up)), away = Math.sqrt(away2) || 1;
      let best = -2;
      for (let i = 0; i < centres.length; ++i) {
        const c = centres[i], near = c[0] * dx / away * level + c[1] * dy / away * level + c[2] * up;
        if (near > best) { best = near; owner[y * half + x] = i; }
      }
    }
  mosaic = { key, owner, half };
  return mosaic;
}

function fillMosaic(pen, patches) {
  const { owner, half } = mosaicOf(patches);
  const small = document.createElement("canvas");
  small.width = small.height = half;
  const smallPen = small.getContext("2d"), pixels = smallPen.createImageData(half, half);
  for (let i = 0; i < owner.length; ++i) {
    if (owner[i] < 0) continue;
    const c = Math.min(1, Math.max(0, patches[owner[i]][3] || 0));
    // A border between patches, so that missing ones can be told apart.
    const edge = owner[i + 1] !== owner[i] || owner[i + half] !== owner[i];
    const shade = edge ? 0.35 + 0.65 * c : c;
    pixels.data.set([255 * (1 - shade), 255 - 175 * shade, 255 - 115 * shade, 255], 4 * i);
  }
  smallPen.putImageData(pixels, 0, 0);
  pen.drawImage(small, 0, 0, size, size);
}

function text(pen, words, x, y, font) {
  pen.font = font;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.lineWidth = 10;
  pen.lineJoin = "round";
  pen.strokeStyle = "#ffffff";
  pen.strokeText(words, x, y);
  pen.fillStyle = "#000000";
  pen.fillText(words, x, y);
}

function brightLights(pen, patches) {
  const usual = 1 / patches.length;
  for (const p of patches) {
    if (!(p[2] > 4 * usual)) continue;
    const [x, y] = place(p[0], p[1]);
    pen.beginPath();
    pen.arc(x, y, 12, 0, 2 * Math.PI);
    pen.fillStyle = "#ffd500";
    pen.fill();
    pen.lineWidth = 5;
    pen.strokeStyle = "#000000";
    pen.stroke();
  }
}

function goHere(pen, advice) {
  const [x, y] = place(advice.azimuth_deg, advice.elevation_deg);
  for (const [width, colour] of [[22, "#ffffff"], [14, "#000000"], [7, "#ff2000"]]) {
    pen.lineWidth = width;
    pen.strokeStyle = colour;
    pen.beginPath();
    pen.arc(x, y, 36, 0, 2 * Math.PI);
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      pen.moveTo(x + 26 * dx, y + 26 * dy);
      pen.lineTo(x + 54 * dx, y + 54 * dy);
    }
    pen.stroke();
  }
  const below = y < middle ? 1 : -1, inside = Math.min(size - 110, Math.max(110, x));
  text(pen, "GO HERE", inside, y + below * 84, "800 42px system-ui, sans-serif");
}

function guidance(coverage, state) {
  byId("guidance").hidden = !coverage;
  if (!coverage) return;
  const percent = Math.round(100 * (coverage.covered || 0)) + " %";
  say("covered", percent);
  const advice = state === "recording" && !coverage.done ? coverage.advice : null;
  say("advice", coverage.done ? "Enough is covered" : advice ? advice.text : "");
  const pen = byId("hemisphere").getContext("2d");
  pen.clearRect(0, 0, size, size);
  if (coverage.patches.length > 0) fillMosaic(pen, coverage.patches);
  pen.beginPath();
  pen.arc(middle, middle, radius, 0, 2 * Math.PI);
  pen.lineWidth = 6;
  pen.strokeStyle = "#000000";
  pen.stroke();
  text(pen, "x", middle + radius + 30, middle, "700 40px system-ui, sans-serif");
  text(pen, "y", middle, middle - radius - 30, "700 40px system-ui, sans-serif");
  brightLights(pen, coverage.patches);
  if (advice) goHere(pen, advice);
  const label = percent + " of the light is covered" + (advice ? "; go to azimuth " + Math.round(advice.azimuth_deg) +
    "°, elevation " + Math.round(advice.elevation_deg) + "°" : "");
  if (byId("hemisphere").getAttribute("aria-label") !== label) byId("hemisphere").setAttribute("aria-label", label);
}

function outline(pen, corners, scale) {
  pen.beginPath();
  for (const [x, y] of corners) pen.lineTo(x * scale, y * scale);
  pen.closePath();
  for (const [width, colour] of [[6, "#000000"], [3, "#ffd500"]]) {
    pen.lineWidth = width;
    pen.strokeStyle = colour;
    pen.stroke();
  }
}

function picture() {
  byId("picture").hidden = !preview;
  if (!preview || preview.width < 1 || preview.height < 1) return;
  const grey = atob(preview.grey), small = document.createElement("canvas");
  small.width = preview.width;
  small.height = preview.height;
  const pen = small.getContext("2d"), pixels = pen.createImageData(preview.width, preview.height);
  for (let i = 0; i < grey.length; ++i) {
    const level = grey.charCodeAt(i);
    pixels.data.set([level, level, level, 255], 4 * i);
  }
  pen.putImageData(pixels, 0, 0);
  // Drawn larger than it is, so that the tags' outlines are fine.
  const shown = byId("preview"), times = Math.max(1, Math.floor(768 / preview.width));
  shown.width = preview.width * times;
  shown.height = preview.height * times;
  const large = shown.getContext("2d");
  large.drawImage(small, 0, 0, shown.width, shown.height);
  for (const tag of preview.tags) outline(large, tag.corners_px, times / preview.frame_px_per_preview);
  const seen = preview.tags.length + (preview.tags.length === 1 ? " tag" : " tags");
  say("tags", preview.tags.length === 0 ? "no tags seen" : preview.posed ? seen + ", mirror found" : seen);
}

let asked = null;  // how many answers there were when this browser asked for a start
function answers() { return latest && latest.start_answer ? latest.start_answer.number : 0; }

function startPanel() {
  const s = latest.status;
  const possible = latest.connected && latest.remote_start && s && s.state !== "recording" && s.state !== "metering";
  byId("start").hidden = !possible;
  byId("token-row").hidden = Boolean(localStorage.getItem("mirrorfield-token"));
  // Only what this browser asked for, and not an older answer.
  if (asked === null || answers() <= asked) return;
  if (!latest.start_answer.accepted) say("start-answer", "Refused: " + latest.start_answer.reason);
  asked = null;
}

async function start(event) {
  event.preventDefault();
  const token = localStorage.getItem("mirrorfield-token") || byId("token").value.trim();
  const before = answers();
  say("start-answer", "Asking…");
  try {
    const answer = await fetch("/start", { method: "POST", headers: { "Content-Type": "application/json" },
                                           body: JSON.stringify({ token }) });
    if (answer.ok) asked = before;
    if (answer.ok) localStorage.setItem("mirrorfield-token", token);
    if (answer.status === 403) localStorage.removeItem("mirrorfield-token");
    byId("token-row").hidden = answer.status !== 403;
    say("start-answer", (await answer.text()).trim());
  } catch (e) {
    say("start-answer", "The rig does not answer.");
  }
}

function show() {
  const away = (Date.now() - heard) / 1000;
  const quiet = latest ? away + (latest.age_s || 0) : away;
  const cut = !latest || away > 4;
  const stale = cut || !latest.connected || quiet > 4;
  document.body.classList.toggle("stale", stale);
  const ago = (seconds) => Math.floor(seconds) + " s";
  if (cut && !heard) banner("offline", "CONNECTING", "");
  else if (cut) banner("offline", "NO CONNECTION", "The rig does not answer", ago(away));
  else if (!latest.connected) banner("offline", "RECORDER OFF", "");
  else if (!latest.status) banner("offline", "WAITING", "The recorder has said nothing yet");
  else if (quiet > 4) banner("offline", "NO NEWS", "The recorder is silent", ago(quiet));
  else bannerOf(latest.status);
  const problem = cut ? "" : latest.connected ? (latest.status ? latest.status.problem : "") : latest.problem;
  say("problem", problem || "");
  byId("problem").hidden = !problem;
}

function onStatus(event) {
  latest = JSON.parse(event.data);
  heard = Date.now();
  show();
  if (latest.status) {
    numbers(latest.status);
    guidance(latest.status.coverage, latest.status.state);
    if (!latest.status.preview) say("tags", preview ? "paused" : "");
  }
  startPanel();
}

function listen() {
  const events = new EventSource("/events");
  events.addEventListener("status", onStatus);
  events.addEventListener("preview", (event) => { preview = JSON.parse(event.data); picture(); });
  // A refused stream stays closed; the browser opens a broken one again by itself.
  events.onerror = () => { if (events.readyState === EventSource.CLOSED) setTimeout(listen, 3000); };
}

// A link with #token=… pairs this browser; what stands behind # is not sent to the rig, and does not stay in the address.
const pairing = new URLSearchParams(location.hash.slice(1)).get("token");
if (pairing) {
  localStorage.setItem("mirrorfield-token", pairing);
  history.replaceState(null, "", location.pathname);
}
byId("start-form").addEventListener("submit", start);
setInterval(show, 1000);
listen();
