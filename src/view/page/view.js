// The page: asks for what is new, shows it, and passes on what its user does.
import { blockStates, countStates, drawBlocks } from "./blocks.js";
import { Movement } from "./movement.js";
import { PictureCanvas } from "./picture.js";
import { addressOfSaved, readBlocks, readPicture, readPixel, readState, sendLimit } from "./server.js";
import { Timeline } from "./timeline.js";
import { bytesText, countText, samplesText, secondsText, shareText } from "./words.js";

const element = (id) => document.getElementById(id);
const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
const picture = new PictureCanvas(element("picture"));
const timeline = new Timeline(element("timeline"));
let state = null, blocks = null, gone = false;

const movement = new Movement(element("picture"), {
  moved: (camera) => {
    element("camera").textContent = camera.text();
    drawOverlaySoon();
  },
  clicked: showPixel,
  doubleClicked: orbitAbout,
  failed: (error) => notice(error.message, true),
});

let noticeTimer;
function notice(text, bad = false) {
  const box = element("notice");
  box.textContent = text;
  box.classList.toggle("bad", bad);
  box.hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(() => (box.hidden = true), bad ? 8000 : 2500);
}

// As large as there is room for, in the picture's own shape.
function layOut() {
  if (!state) return;
  const stage = element("stage"), words = element("help").offsetHeight + element("pixel").offsetHeight + 14;
  const room = { x: stage.clientWidth - 28, y: stage.clientHeight - 28 - words };
  const scale = Math.min(room.x / state.width, room.y / state.height, 4);
  const frame = element("frame");
  frame.style.width = `${Math.max(1, Math.floor(state.width * scale))}px`;
  frame.style.height = `${Math.max(1, Math.floor(state.height * scale))}px`;
  const overlay = element("overlay"), ratio = window.devicePixelRatio || 1;
  overlay.width = Math.round(frame.clientWidth * ratio);
  overlay.height = Math.round(frame.clientHeight * ratio);
  drawOverlay();
}

function drawOverlay() {
  const shown = element("blocks").checked;
  element("block-legend").hidden = !shown;
  drawBlocks(element("overlay"), shown ? blocks : null, movement.camera);
}

// Mice move more often than there is something new to be seen.
let overlayWaits = false;
function drawOverlaySoon() {
  if (overlayWaits) return;
  overlayWaits = true;
  requestAnimationFrame(() => {
    overlayWaits = false;
    drawOverlay();
  });
}

function showState() {
  const s = state;
  document.title = `${s.title} - raypager`;
  element("title").textContent = s.title;
  element("size").textContent = `${s.width} x ${s.height}`;
  const phase = element("phase");
  phase.textContent = s.phase;
  phase.className = `phase ${s.phase}`;
  if (s.phase === "starting") return;
  picture.resize(s.width, s.height);
  element("spp").textContent = s.of_spp < 65535 ? `${samplesText(s.spp)} of ${s.of_spp}` : samplesText(s.spp);
  element("progress").firstElementChild.style.width = s.of_spp < 65535 ? `${(100 * s.spp) / s.of_spp}%` : "0";
  element("time").textContent = secondsText(s.seconds);
  element("rays").textContent = countText(s.rays);
  element("rate").textContent = s.phase === "finished" ? "0" : countText(s.rays_per_second);
  const pool = Math.min(s.pool_bytes, s.geometry_bytes);
  element("resident").textContent = `${bytesText(s.resident_bytes)}, ${shareText(s.resident_bytes, s.geometry_bytes)}`;
  element("pool").textContent = `${bytesText(pool)} of ${bytesText(s.geometry_bytes)}`;
  element("loaded").textContent = `${bytesText(s.bytes_loaded)}, ${countText(s.loads)}`;
  element("bandwidth").textContent = `${bytesText(s.bytes_per_second)}, ${countText(s.loads_per_second)}`;
  const { bytes, percent } = s.limit;
  element("limit").placeholder = bytes ? bytesText(bytes) : percent ? `${percent}%` : "none; 25%, 512M";
  element("copy").disabled = !s.camera;
  element("reset").disabled = !s.camera_moves;
  movement.take(s);
  if (!movement.timer) element("camera").textContent = s.camera || "a camera that --camera cannot describe";
  element("help").style.visibility = s.camera_moves ? "visible" : "hidden";
}

let exposure = 0;  // in stops; finer, or further, than the slider may say

function setExposure(stops) {
  exposure = stops;
  element("stops").textContent = (stops > 0 ? "+" : "") + stops.toFixed(1);
  picture.setExposure(stops);
}

async function showPixel(x, y) {
  const line = element("pixel"), at = [Math.floor(x), Math.floor(y)];
  try {
    const found = await readPixel(...at);
    const rows = [["pixel", at.join(", ")]];
    if (found.samples === 0) rows.push(["no sample there yet", ""]);
    else if ("material" in found && !found.material) rows.push([found.samples < 4 ? "nothing seen there yet" : "nothing there", ""]);
    else {
      if ("depth" in found) rows.push(["depth", found.depth === null ? "none" : Number(found.depth.toPrecision(6))]);
      for (const name of ["material", "object", "instance"]) if (name in found) rows.push([name, found[name] || "none"]);
      if ("samples" in found) rows.push(["samples", found.samples]);
    }
    if (rows.length === 1) rows.push(["the film keeps nothing of pixels", "--layers"]);
    line.replaceChildren(...rows.flatMap(([name, value]) => {
      const label = document.createElement("b");
      label.textContent = name;
      return [label, ` ${value}`];
    }));
    return found;
  } catch (error) {
    notice(error.message, true);
    return null;
  }
}

// The eye stays; what is there comes into the middle, and orbits go about it.
async function orbitAbout(x, y) {
  if (!movement.camera || !movement.moves) return;
  const found = await showPixel(x, y);
  if (!found?.depth || !found.material) return;
  const camera = movement.camera;  // it may be another one by now
  camera.lookAt(camera.pointAt(x, y, found.depth, state.width, state.height));
  movement.moved();
}

async function copyCamera() {
  const line = `--camera ${movement.camera?.text() ?? state.camera}`;
  try {
    await navigator.clipboard.writeText(line);
    notice("copied");
  } catch {
    notice(line);
  }
}

function save(format) {
  const link = document.createElement("a");
  link.href = addressOfSaved(format, exposure);
  link.download = `raypager.${format}`;
  link.click();
}

async function setLimit(event) {
  event.preventDefault();
  const limit = element("limit"), text = limit.value.trim();
  try {
    await sendLimit(text);
    limit.value = "";
    notice(text ? `limit ${text}: the picture goes on` : "no limit but that of memory");
  } catch (error) {
    notice(error.message, true);
  }
}

function lost() {
  if (gone) return;
  gone = true;
  element("phase").textContent = "ended: the program is no longer there";
  element("phase").className = "phase gone";
}

async function followState() {
  for (let misses = 0; misses < 4; ) {
    try {
      const first = state === null || state.phase === "starting";
      state = await readState();
      misses = 0;
      if (first && state.phase !== "starting") {
        element("exposure").value = state.exposure;
        setExposure(state.exposure);
      }
      showState();
      if (first) layOut();
      if (state.phase !== "starting") timeline.add(state);
    } catch {
      misses++;
    }
    await pause(document.hidden ? 1000 : 250);
  }
  lost();
}

async function followPicture() {
  for (let number = 0; !gone; ) {
    try {
      const next = document.hidden ? null : await readPicture(number);
      if (!next) {
        await pause(document.hidden ? 500 : 0);
        continue;
      }
      number = next.number;
      picture.show(next);
      movement.pictureShown(next.view);
    } catch {
      await pause(500);
    }
  }
}

async function followBlocks() {
  while (!gone) {
    if (element("blocks").checked && !document.hidden) {
      try {
        blocks = await readBlocks();
        const counts = countStates(blocks);
        for (const name of blockStates) element(`${name}-blocks`).textContent = counts[name];
        const others = state.blocks - blocks.count;
        element("other-blocks").hidden = others === 0;
        element("other-blocks").textContent = `and ${countText(others)} that are not drawn`;
        drawOverlay();
      } catch {
        // The state says so if nobody is there any more.
      }
    }
    await pause(250);
  }
}

element("exposure").addEventListener("input", () => setExposure(Number(element("exposure").value)));
element("save-png").addEventListener("click", () => save("png"));
element("save-exr").addEventListener("click", () => save("exr"));
element("copy").addEventListener("click", copyCamera);
element("reset").addEventListener("click", () => movement.reset());
element("limits").addEventListener("submit", setLimit);
element("blocks").addEventListener("change", drawOverlay);
window.addEventListener("resize", layOut);
followState();
followPicture();
followBlocks();
// For who drives the page.
window.raypager = { picture, movement, get state() { return state; } };
