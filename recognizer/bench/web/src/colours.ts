/** Colours of readings: viridis, even in lightness and safe for the colour-blind. */

const ANCHORS = [
  [68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142],
  [31, 158, 137], [53, 183, 121], [109, 205, 89], [180, 222, 44], [253, 231, 37],
] as const;

/** 256 colours, r g b each 0 ... 255. */
export const TABLE: Uint8ClampedArray = (() => {
  const table = new Uint8ClampedArray(256 * 3);
  for (let i = 0; i < 256; i++) {
    const at = (i / 255) * (ANCHORS.length - 1);
    const low = Math.min(Math.floor(at), ANCHORS.length - 2);
    const a = ANCHORS[low]!, b = ANCHORS[low + 1]!;
    for (let c = 0; c < 3; c++) table[3 * i + c] = a[c]! + (b[c]! - a[c]!) * (at - low);
  }
  return table;
})();

export function gradient(): string {
  return `linear-gradient(90deg, ${ANCHORS.map((c) => `rgb(${c.join(" ")})`).join(", ")})`;
}

/** Calm, distinct hues for objects; the same object has the same one. */
export function hue(number: number): number {
  return (205 + number * 137.5) % 360;
}
