// The wire format of binary messages, as palpate/viewer/wire.py has it: u8 kind, the fixed fields in their order, then each
// list with its count in front; little-endian, without padding.

const FIXED = {
  flag: ["Uint8", 1, 1],
  u8: ["Uint8", 1, 1],
  u16: ["Uint16", 2, 1],
  u32: ["Uint32", 4, 1],
  f32: ["Float32", 4, 1],
  f64: ["Float64", 8, 1],
  vec3: ["Float32", 4, 3],
  vec3d: ["Float64", 8, 3],
} as const; // how a DataView calls it, bytes of a number, numbers

/** Names and kinds of a message's fields, lists last. */
export type Layout = readonly (readonly [name: string, kind: keyof typeof FIXED | "floats"])[];

export function encode(kind: number, layout: Layout, message: object): ArrayBuffer {
  const values = message as Record<string, boolean | number | ArrayLike<number>>;
  const length = layout.reduce((sum, [name, type]) => {
    if (type === "floats") return sum + 4 + 4 * (values[name] as ArrayLike<number>).length;
    return sum + FIXED[type][1] * FIXED[type][2];
  }, 1);
  const view = new DataView(new ArrayBuffer(length));
  view.setUint8(0, kind);
  let at = 1;
  for (const [name, type] of layout) {
    const value = values[name]!;
    const numbers = typeof value === "object" ? value : [Number(value)];
    if (type === "floats") {
      view.setUint32(at, numbers.length, true);
      at += 4;
    }
    const [call, size] = FIXED[type === "floats" ? "f32" : type];
    for (let i = 0; i < numbers.length; i++, at += size) view[`set${call}`](at, numbers[i]!, true);
  }
  return view.buffer;
}

export function decode<Message>(layout: Layout, buffer: ArrayBuffer): Message {
  const view = new DataView(buffer);
  const values: Record<string, unknown> = {};
  let at = 1;
  for (const [name, type] of layout) {
    if (type === "floats") {
      const end = at + 4 + 4 * view.getUint32(at, true);
      // sliced: a Float32Array must start at a multiple of 4; every platform with WebGL is little-endian
      values[name] = new Float32Array(buffer.slice(at + 4, end));
      at = end;
      continue;
    }
    const [call, size, count] = FIXED[type];
    const numbers = Array.from({ length: count }, (_, i) => view[`get${call}`](at + i * size, true));
    values[name] = type === "flag" ? numbers[0] !== 0 : count === 1 ? numbers[0] : numbers;
    at += size * count;
  }
  return values as Message;
}
