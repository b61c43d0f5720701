/** Vertices at one place: split at a seam of the texture or a hold's border, they are several. */

type Ids = Int32Array<ArrayBuffer>;

export interface WeldedVertices {
  /** Number of each vertex's place. */
  weld: Ids;
  /** A vertex at each place. */
  vertex: Ids;
}

/** Vertices at the same place get the same number. */
export function weldVertices(places: Float32Array): WeldedVertices {
  const count = places.length / 3;
  const bits = new Int32Array(places.buffer, places.byteOffset, places.length);
  const size = 2 ** Math.ceil(Math.log2(2 * count + 1));
  const table = new Int32Array(size).fill(-1);
  const weld = new Int32Array(count);
  const vertex = new Int32Array(count);
  let next = 0;
  for (let v = 0; v < count; v++) {
    const [x, y, z] = [bits[3 * v]!, bits[3 * v + 1]!, bits[3 * v + 2]!];
    let slot = (Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791)) >>> 0;
    slot = (slot ^ (slot >>> 15)) & (size - 1);
    for (; ; slot = (slot + 1) & (size - 1)) {
      const known = table[slot]!;
      if (known >= 0) {
        const one = 3 * vertex[known]!;
        if (bits[one] !== x || bits[one + 1] !== y || bits[one + 2] !== z) continue;
        weld[v] = known;
      } else {
        table[slot] = next;
        vertex[next] = v;
        weld[v] = next++;
      }
      break;
    }
  }
  return { weld, vertex: vertex.slice(0, next) };
}
