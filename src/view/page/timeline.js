// The last minute: bytes that were resident, as an area under the line of the pool, and bytes loaded per second, as bars.

const seconds = 60;

export class Timeline {
  constructor(canvas) {
    this.canvas = canvas;
    this.moments = [];
  }

  add(state) {
    const now = performance.now() / 1000;
    this.moments.push({ now, resident: state.resident_bytes, pool: state.pool_bytes, loaded: state.bytes_per_second });
    while (this.moments.length > 2 && this.moments[1].now < now - seconds) this.moments.shift();
    this.draw(now);
  }

  draw(now) {
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    if (width === 0) return;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    const most = Math.max(1, ...this.moments.map((m) => Math.max(m.resident, m.pool)));
    const fastest = Math.max(1, ...this.moments.map((m) => m.loaded));
    const x = (moment) => width * (1 - (now - moment.now) / seconds);
    const y = (bytes) => height - 1 - (height - 6 * ratio) * (bytes / most);

    context.fillStyle = "rgba(79, 160, 124, 0.35)";
    context.strokeStyle = "#4fa07c";
    context.lineWidth = 1.5 * ratio;
    context.beginPath();
    this.moments.forEach((m, i) => (i ? context.lineTo(x(m), y(m.resident)) : context.moveTo(x(m), y(m.resident))));
    context.stroke();
    if (this.moments.length > 1) {
      context.lineTo(x(this.moments.at(-1)), height);
      context.lineTo(x(this.moments[0]), height);
      context.fill();
    }

    context.strokeStyle = "#e0b341";
    context.lineWidth = Math.max(1, ratio);
    context.beginPath();
    for (const m of this.moments) {
      if (m.loaded <= 0) continue;
      context.moveTo(x(m), height);
      context.lineTo(x(m), height - 0.45 * height * (m.loaded / fastest));
    }
    context.stroke();

    context.strokeStyle = "#8b929b";
    context.lineWidth = ratio;
    context.setLineDash([4 * ratio, 3 * ratio]);
    context.beginPath();
    this.moments.forEach((m, i) => (i ? context.lineTo(x(m), y(m.pool)) : context.moveTo(x(m), y(m.pool))));
    context.stroke();
    context.setLineDash([]);
  }
}
