// Mouse and keys move the camera; the program is told as fast as it can show it.
import { Camera } from "./camera.js";
import { sendCamera } from "./server.js";

const still = 220; // milliseconds without a movement, after which the picture is made at full size
const keys = { KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0] };

export class Movement {
  // shown(view): whether a picture of that view has been drawn. events: moved(camera), clicked(x, y), doubleClicked(x, y), failed(error)
  constructor(canvas, events) {
    this.canvas = canvas;
    this.events = events;
    this.camera = null;
    this.first = null;
    this.moves = false;
    this.view = 0;
    this.seen = 0;
    this.wanted = null;
    this.sending = false;
    this.held = new Set();
    this.listen();
  }

  // What the program shows, unless the user is about to show something else.
  take(state) {
    this.moves = state.camera_moves;
    this.canvas.classList.toggle("moves", this.moves);
    if (this.sending || this.wanted || this.timer || this.drag || !state.camera) return;
    const camera = Camera.parse(state.camera);
    if (!camera || this.camera?.rounded() === camera.rounded()) return;
    this.camera = camera;
    this.first ??= this.camera.copy();
  }

  pictureShown(view) {
    this.seen = Math.max(this.seen, view);
    this.send();
  }

  reset() {
    if (!this.first || !this.moves) return;
    this.camera = this.first.copy();
    this.want(false);
  }

  moved() {
    this.events.moved(this.camera);
    this.want(true);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.timer = null;
      if (this.held.size === 0) this.want(false);
    }, still);
  }

  want(moving) {
    this.wanted = { text: this.camera.text(), moving };
    this.send();
  }

  // A camera is sent when the picture of the one before it has been seen, so that there is always something to see.
  async send() {
    if (!this.wanted || this.sending) return;
    if (this.wanted.moving && this.seen < this.view && performance.now() - this.sent < 1000) return;
    const { text, moving } = this.wanted;
    this.wanted = null;
    this.sending = true;
    try {
      this.view = (await sendCamera(text, moving)).view;
      this.sent = performance.now();
    } catch (error) {
      this.events.failed(error);
    }
    this.sending = false;
    this.send();
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [((event.clientX - box.left) / box.width) * this.canvas.width, ((event.clientY - box.top) / box.height) * this.canvas.height];
  }

  listen() {
    const canvas = this.canvas;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      this.drag = { x: event.clientX, y: event.clientY, far: false, pans: event.button !== 0 || event.shiftKey, left: event.button === 0 };
    });
    canvas.addEventListener("pointermove", (event) => this.dragged(event));
    canvas.addEventListener("pointerup", (event) => {
      const drag = this.drag;
      this.drag = null;
      canvas.classList.remove("moving");
      if (drag && !drag.far && drag.left) this.events.clicked(...this.place(event));
    });
    canvas.addEventListener("pointercancel", () => (this.drag = null));
    canvas.addEventListener("dblclick", (event) => this.events.doubleClicked(...this.place(event)));
    canvas.addEventListener("wheel", (event) => {
      if (!this.moves || !this.camera) return;
      event.preventDefault();
      this.camera.zoom(Math.exp(Math.max(-0.5, Math.min(0.5, event.deltaY * 0.0015))));
      this.moved();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.keyDown(event));
    canvas.addEventListener("keyup", (event) => this.held.delete(event.code));
    canvas.addEventListener("blur", () => this.held.clear());
  }

  dragged(event) {
    const drag = this.drag;
    if (!drag || !this.moves || !this.camera) return;
    const dx = event.clientX - drag.x, dy = event.clientY - drag.y;
    if (!drag.far && Math.hypot(dx, dy) < 4) return;
    Object.assign(drag, { x: event.clientX, y: event.clientY, far: true });
    this.canvas.classList.add("moving");
    const box = this.canvas.getBoundingClientRect(), size = Math.min(box.width, box.height);
    if (drag.pans) this.camera.pan(dx / size, dy / size);
    else this.camera.orbit((Math.PI * dx) / size, (-Math.PI * dy) / size);
    this.moved();
  }

  keyDown(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || !this.moves || !this.camera) return;
    if (event.code === "KeyR") this.reset();
    if (!(event.code in keys)) return;
    event.preventDefault();
    const begins = this.held.size === 0;
    this.held.add(event.code);
    if (begins) this.fly(performance.now());
  }

  // A third of the way to the target per second.
  fly(last) {
    requestAnimationFrame((now) => {
      if (this.held.size === 0) return;
      const way = Math.min(0.1, (now - last) / 1000) * 0.35 * this.camera.distance;
      const sum = [0, 0, 0];
      for (const code of this.held) keys[code].forEach((value, k) => (sum[k] += value * way));
      this.camera.fly(...sum);
      this.moved();
      this.fly(now);
    });
  }
}
