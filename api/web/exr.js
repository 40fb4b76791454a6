// Reads the OpenEXR files that the service writes: one part, scan lines, 32-bit floats, zipped.

const MAGIC = 20000630;
const FLOAT = 2;
/** Scan lines per block, by the number of the compression. */
const LINES = { 0: 1, 2: 1, 3: 16 }; // none, ZIPS, ZIP

/**
 * The light of a picture: `{ width, height, light }`, three numbers per pixel, top row first.
 * @param {ArrayBuffer} buffer the file
 */
export async function readExr(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0, true) !== MAGIC) throw new Error("not an OpenEXR file");
  const { attributes, end } = readHeader(view);
  const lines = LINES[attributes.get("compression").getUint8(0)];
  const channels = channelsOf(attributes.get("channels"));
  if (!lines || channels.some((channel) => channel.type !== FLOAT)) throw new Error("an OpenEXR file of another kind");
  const [left, top, right, bottom] = [0, 4, 8, 12].map((at) => attributes.get("dataWindow").getInt32(at, true));
  const [width, height] = [right - left + 1, bottom - top + 1];
  const light = new Float32Array(3 * width * height);
  const blocks = Array.from({ length: Math.ceil(height / lines) }, (_, i) => Number(view.getBigUint64(end + 8 * i, true)));
  await Promise.all(blocks.map(async (at) => {
    const first = view.getInt32(at, true) - top;
    const size = view.getInt32(at + 4, true);
    const rows = Math.min(lines, height - first);
    const raw = 4 * channels.length * width * rows;
    const data = await unpack(new Uint8Array(buffer, at + 8, size), raw);
    spread(new DataView(data.buffer, data.byteOffset, raw), { light, channels, width, first, rows });
  }));
  return { width, height, light };
}

function readHeader(view) {
  const attributes = new Map();
  let at = 8;
  const word = () => {
    let text = "";
    for (let code; (code = view.getUint8(at++)); ) text += String.fromCharCode(code);
    return text;
  };
  for (let name; (name = word()); ) {
    word(); // its type, which the name tells
    const size = view.getInt32(at, true);
    attributes.set(name, new DataView(view.buffer, at + 4, size));
    at += 4 + size;
  }
  return { attributes, end: at };
}

/** In the order in which they follow each other in each line. */
function channelsOf(view) {
  const channels = [];
  for (let at = 0; view.getUint8(at); at += 16) {
    let name = "";
    for (let code; (code = view.getUint8(at++)); ) name += String.fromCharCode(code);
    channels.push({ name, type: view.getInt32(at, true) });
  }
  return channels;
}

/** A block as it was before it was packed; one that packing would not have made smaller is left as it is. */
async function unpack(packed, size) {
  if (packed.length === size) return packed.slice();
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  // Differences of neighbours, and all first halves of pairs before all second ones.
  for (let i = 1; i < size; i += 1) bytes[i] += bytes[i - 1] - 128;
  const data = new Uint8Array(size);
  const half = Math.ceil(size / 2);
  for (let i = 0; i < size; i += 1) data[i] = bytes[i % 2 ? half + (i - 1) / 2 : i / 2];
  return data;
}

function spread(view, { light, channels, width, first, rows }) {
  for (let row = 0, at = 0; row < rows; row += 1) {
    for (const { name } of channels) {
      const channel = "RGB".indexOf(name);
      for (let x = 0; x < width; x += 1, at += 4) {
        if (channel >= 0) light[3 * ((first + row) * width + x) + channel] = view.getFloat32(at, true);
      }
    }
  }
}
