// What the page asks the program. All addresses are relative: they keep the token of the page's own.

async function failure(response) {
  const text = await response.text();
  try {
    return new Error(JSON.parse(text).error);
  } catch {
    return new Error(text || `status ${response.status}`);
  }
}

async function get(name, query = {}) {
  const parameters = new URLSearchParams(query).toString();
  const response = await fetch(parameters ? `${name}?${parameters}` : name);
  if (!response.ok) throw await failure(response);
  return response;
}

async function post(name, command) {
  const response = await fetch(name, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(command),
  });
  if (!response.ok) throw await failure(response);
  return response.json();
}

export const readState = async () => (await get("state")).json();

// The next picture after that number: {number, view, width, height, spp, last, pixels}, three halves a pixel. Nothing if none came in time.
export async function readPicture(after) {
  const response = await get("picture", { after });
  if (response.status === 204) return null;
  const about = JSON.parse(response.headers.get("Raypager-Picture"));
  return { ...about, pixels: new Uint16Array(await response.arrayBuffer()) };
}

// Records of eight words: the corners of a block (floats), its state, rays that wait for it.
export async function readBlocks() {
  const bytes = await (await get("blocks")).arrayBuffer();
  return { floats: new Float32Array(bytes), words: new Uint32Array(bytes), count: bytes.byteLength / 32 };
}

export const readPixel = async (x, y) => (await get("pick", { x, y })).json();
export const sendCamera = (camera, moving) => post("camera", { camera, moving });
export const sendLimit = (limit) => post("limit", { limit });
export const addressOfSaved = (format, exposure) => `save?${new URLSearchParams({ format, exposure })}`;
