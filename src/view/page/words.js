// Figures as people read them, as the program prints them.

export function bytesText(bytes) {
  const units = ["bytes", "KiB", "MiB", "GiB", "TiB"];
  let unit = 0;
  for (; bytes >= 1024 && unit < units.length - 1; unit++) bytes /= 1024;
  return `${unit === 0 ? Math.round(bytes) : bytes.toFixed(1)} ${units[unit]}`;
}

export function countText(count) {
  for (const [unit, letter] of [[1e9, "G"], [1e6, "M"], [1e3, "K"]])
    if (count >= unit) return `${(count / unit).toFixed(count < 10 * unit ? 2 : 1)} ${letter}`;
  return String(Math.round(count));
}

export function secondsText(seconds) {
  if (seconds < 60) return `${seconds.toFixed(1)} s`;
  const whole = Math.floor(seconds), two = (n) => String(n).padStart(2, "0");
  const minutes = Math.floor(whole / 60);
  return minutes < 60 ? `${minutes}:${two(whole % 60)}` : `${Math.floor(minutes / 60)}:${two(minutes % 60)}:${two(whole % 60)}`;
}

export const samplesText = (spp) => (spp < 10 ? spp.toFixed(2) : spp < 100 ? spp.toFixed(1) : String(Math.round(spp)));
export const shareText = (part, whole) => (whole > 0 ? `${((100 * part) / whole).toFixed(1)} %` : "");
