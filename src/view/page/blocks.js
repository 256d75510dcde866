// The blocks of the scene as boxes over the picture, by what becomes of them.

export const blockStates = ["absent", "coming", "resident", "wanted"];
const styles = {
  absent: { stroke: "rgba(138, 147, 158, 0.30)", width: 1 },
  resident: { stroke: "rgba(96, 196, 150, 0.55)", width: 1 },
  coming: { stroke: "rgba(240, 192, 70, 0.95)", width: 1.6 },
  wanted: { stroke: "rgba(240, 110, 62, 0.95)", width: 1.6 },
};
const edges = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

function stateOf(records, i) {
  const state = records.words[8 * i + 6];
  if (state === 0 && records.words[8 * i + 7] > 0) return "wanted";
  return blockStates[state] ?? "absent";
}

export function countStates(records) {
  const counts = { absent: 0, coming: 0, resident: 0, wanted: 0 };
  for (let i = 0; i < records.count; i++) counts[stateOf(records, i)]++;
  return counts;
}

// From near to far of an edge, cut off where it comes too close to the eye's plane.
function strokeEdge(context, camera, a, b, width, height, near) {
  let p = camera.project(a, width, height), q = camera.project(b, width, height);
  if (p.ahead < near && q.ahead < near) return;
  if (p.ahead < near || q.ahead < near) {
    const share = (near - p.ahead) / (q.ahead - p.ahead);
    const cut = camera.project(a.map((value, k) => value + share * (b[k] - value)), width, height);
    if (p.ahead < near) p = cut;
    else q = cut;
  }
  context.moveTo(p.x, p.y);
  context.lineTo(q.x, q.y);
}

export function drawBlocks(canvas, records, camera) {
  const context = canvas.getContext("2d");
  const { width, height } = canvas;
  context.clearRect(0, 0, width, height);
  if (!records || !camera) return;
  const near = 1e-3 * camera.distance;
  for (const name of ["absent", "resident", "coming", "wanted"]) {
    context.beginPath();
    for (let i = 0; i < records.count; i++) {
      if (stateOf(records, i) !== name) continue;
      const box = records.floats.subarray(8 * i, 8 * i + 6);
      const corners = [];
      for (let k = 0; k < 8; k++) corners.push([box[k & 1 ? 3 : 0], box[k & 2 ? 4 : 1], box[k & 4 ? 5 : 2]]);
      for (const [from, to] of edges) strokeEdge(context, camera, corners[from], corners[to], width, height, near);
    }
    context.globalAlpha = styles[name].width > 1 ? 1 : Math.max(0.25, Math.min(1, 400 / records.count));  // many hide the picture
    context.strokeStyle = styles[name].stroke;
    context.lineWidth = styles[name].width * (window.devicePixelRatio || 1);
    context.stroke();
  }
}
