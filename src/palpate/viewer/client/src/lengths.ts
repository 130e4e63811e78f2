// Lengths that a person has written, for drawing at once: `palpate.number_text` and `palpate.units.parse_quantity`, which read
// the text for good when the start is pressed, with the units in which people state lengths.

const UNITS: Record<string, number> = { Mm: 1e6, km: 1e3, m: 1, dm: 0.1, cm: 0.01, mm: 1e-3, um: 1e-6, µm: 1e-6, nm: 1e-9, in: 0.0254, ft: 0.3048 };
const NUMBER =
  /^([+-]? ?)([0-9](?:[0-9.,' ]*[0-9])?|[.,][0-9]+)(?:\.(?![0-9.,]))?(?:[eE]([+-]?[0-9]+)| ?× ?10([⁺⁻]?[⁰¹²³⁴-⁹]+))?\s*([A-Za-zµ]+)$/;
const GROUPED = /^[1-9][0-9]{0,2}([.,' ])[0-9]{3}(?:\1[0-9]{3})*$/;
const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/** A length in m; 0 where the text is none, its comma or its unit allows two readings, or its unit is a rare one. */
export function lengthOf(text: string): number {
  const plain = text.replace(/[\u00a0\u202f\u2009]/g, " ").replace(/’/g, "'").replace(/−/g, "-").replace(/μ/g, "µ").trim();
  const [, sign = "", body, power, raised, unit] = NUMBER.exec(plain) ?? [];
  if (!body || !unit) return 0;
  const [point, comma] = [digits(body, "."), digits(body, ",")];
  const powered = power !== undefined || raised !== undefined;
  if (point && comma && body.includes(",") && !powered) return 0; // 1,234
  const number = !point || (comma && body.includes(",")) ? comma : point;
  const exponent = power ?? [...(raised ?? "0")].map((c) => ({ "⁺": "+", "⁻": "-" })[c] ?? (RAISED.includes(c) ? RAISED.indexOf(c) : c)).join("");
  const value = Number(`${sign.trim()}${number}e${exponent}`) * (UNITS[unit] ?? inOtherCase(unit));
  return number && Number.isFinite(value) ? value : 0;
}

/** The digits of a number with a decimal point, if they are one with this decimal mark. */
function digits(body: string, decimal: string): string | undefined {
  const at = body.indexOf(decimal);
  const [whole, fraction] = at < 0 ? [body, ""] : [body.slice(0, at), body.slice(at + 1)];
  const groups = GROUPED.exec(whole);
  if (!/^[0-9]*$/.test(fraction) || (!/^[0-9]*$/.test(whole) && (!groups || groups[1] === decimal))) return undefined;
  return `${whole.replace(/[.,' ]/g, "")}.${fraction}`;
}

/** The size of a unit in the wrong case, where that can mean one thing only: MM may be millimetres or megametres. */
function inOtherCase(unit: string): number {
  return unit.toLowerCase() === "mm" ? 0 : (UNITS[unit.toLowerCase()] ?? 0);
}
