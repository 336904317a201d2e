// From the blocks of a page to arrays: raw deflate, byte planes. The layout is in
// docs/formats/html-page.md; motes' exporting::html::pack writes it.

const ROW = 1024; // Gaussians per texture row
const CHUNK = 256; // Gaussians that share a bounding box
const BLOCK = 65536; // Gaussians per compressed block

function bytesOfBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Byte planes back to records: plane j holds byte j of every record. The records are padded to
// `paddedStride` bytes and to whole texture rows.
function recordsOfPlanes(planes, count, stride, paddedStride) {
  const rows = Math.ceil(count / ROW);
  const records = new Uint8Array(rows * ROW * paddedStride);
  for (let j = 0; j < stride; j++) {
    const plane = planes.subarray(j * count, (j + 1) * count);
    for (let i = 0, to = j; i < count; i++, to += paddedStride) records[to] = plane[i];
  }
  return records;
}

// Sizes of the records of a splat, bytes.
function strides(manifest) {
  const rest = 3 * ((manifest.sh_degree + 1) ** 2 - 1);
  return { geometry: 16, dc: 4, sh: rest, shPadded: 16 * Math.ceil(rest / 16), material: manifest.materials ? 12 : 0 };
}

// One block: bounding boxes of its chunks, then the planes of each kind of record.
async function blockOf(compressed, count, manifest) {
  const bytes = await inflated(compressed);
  const size = strides(manifest);
  const chunks = new Float32Array(bytes.slice(0, 24 * Math.ceil(count / CHUNK)).buffer);
  let at = chunks.byteLength;
  const next = (stride, padded) => {
    const planes = bytes.subarray(at, (at += stride * count));
    return recordsOfPlanes(planes, count, stride, padded);
  };
  const block = {
    count,
    chunks,
    geometry: next(16, 16),
    dc: next(4, 4),
    sh: next(size.sh, size.shPadded),
    material: next(size.material, 16),
  };
  if (at !== bytes.length) throw new Error(`a block has ${bytes.length} bytes instead of ${at}`);
  return block;
}

// Centers of a block in world, for sorting.
function meansOfBlock(block, out, first) {
  const words = new Uint32Array(block.geometry.buffer);
  for (let i = 0; i < block.count; i++) {
    const box = 6 * (i >> 8);
    const xy = words[4 * i];
    const share = [xy & 0xffff, xy >>> 16, words[4 * i + 1] & 0xffff];
    for (let k = 0; k < 3; k++) {
      out[3 * (first + i) + k] = block.chunks[box + k] + (share[k] / 65535) * block.chunks[box + 3 + k];
    }
  }
}
