// The picture: linear halves, exposed and brought to sRGB by a table of all positive halves, so that another exposure costs nothing but drawing.

const table = new Uint8ClampedArray(65536);
let stopsOfTable = NaN;

function halfValue(half) {
  const exponent = (half >> 10) & 31;
  const fraction = half & 1023;
  if (exponent === 0) return fraction * 2 ** -24;
  if (exponent === 31) return fraction ? 0 : Infinity;
  return (1 + fraction / 1024) * 2 ** (exponent - 15);
}

function expose(stops) {
  if (stops === stopsOfTable) return;
  stopsOfTable = stops;
  const scale = 2 ** stops;
  for (let half = 0; half < 32768; half++) {
    const value = halfValue(half) * scale;
    table[half] = 255 * (value <= 0.0031308 ? 12.92 * value : value < 1 ? 1.055 * value ** (1 / 2.4) - 0.055 : 1);
  }
  // Those below zero stay black.
}

export class PictureCanvas {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.small = document.createElement("canvas");
    this.picture = null;
    this.stops = 0;
    this.drawn = 0;
  }

  // The size of the whole picture; smaller ones are stretched to it.
  resize(width, height) {
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.draw();
  }

  show(picture) {
    this.picture = picture;
    this.draw();
  }

  setExposure(stops) {
    this.stops = stops;
    this.draw();
  }

  draw() {
    const picture = this.picture;
    if (!picture) return;
    expose(this.stops);
    const { width, height, pixels } = picture;
    if (!this.image || this.image.width !== width || this.image.height !== height) this.image = new ImageData(width, height);
    const words = new Uint32Array(this.image.data.buffer);
    for (let i = 0, at = 0; i < words.length; i++, at += 3)
      words[i] = 0xff000000 | (table[pixels[at + 2]] << 16) | (table[pixels[at + 1]] << 8) | table[pixels[at]];
    if (width === this.canvas.width && height === this.canvas.height) {
      this.context.putImageData(this.image, 0, 0);
    } else {
      this.small.width = width;
      this.small.height = height;
      this.small.getContext("2d", { alpha: false }).putImageData(this.image, 0, 0);
      this.context.imageSmoothingQuality = "high";
      this.context.drawImage(this.small, 0, 0, this.canvas.width, this.canvas.height);
    }
    this.drawn++;
  }
}
