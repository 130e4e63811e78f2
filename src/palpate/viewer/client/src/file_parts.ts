// The parts that stand in a page itself, packed by gzip, as scripts of other types (palpate/viewer/file_document.py).

/** Bytes from base64. */
function bytes(text: string): Uint8Array<ArrayBuffer> {
  const own = Uint8Array as unknown as { fromBase64?: (text: string) => Uint8Array<ArrayBuffer> }; // of newer browsers
  if (own.fromBase64) return own.fromBase64(text);
  const decoded = atob(text);
  const out = new Uint8Array(decoded.length);
  for (let i = 0; i < decoded.length; i++) out[i] = decoded.charCodeAt(i);
  return out;
}

/** A part of the page, unpacked. */
export async function part(name: string): Promise<Uint8Array<ArrayBuffer>> {
  const stream = new Blob([bytes(document.getElementById(`palpate-${name}`)!.textContent!)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A part of the page that is JSON. */
export async function json<Type>(name: string): Promise<Type> {
  return JSON.parse(new TextDecoder().decode(await part(name))) as Type;
}

/** Words of `width` bytes, whose bytes of equal weight stand together. */
export function words(bytes: Uint8Array, width = 8): Uint8Array<ArrayBuffer> {
  const count = bytes.length / width;
  const out = new Uint8Array(bytes.length);
  for (let i = 0; i < count; i++) for (let b = 0; b < width; b++) out[width * i + b] = bytes[b * count + i]!;
  return out;
}
