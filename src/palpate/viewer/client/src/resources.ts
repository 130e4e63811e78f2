// Where the parts of a body come from: the server, or the file that the page is.

type Source = (path: string) => Promise<ArrayBuffer>;

let source: Source = async (path) => {
  const answer = await fetch(`./${path}`);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.arrayBuffer();
};

/** Fetch a part of the body. */
export function get(path: string): Promise<ArrayBuffer> {
  return source(path);
}

/** Take parts from elsewhere from now on. */
export function provide(other: Source): void {
  source = other;
}
