/** The picture that is saved: what is drawn, with the flags and a line that says what it is. */

import type { Flag } from "../scene/overlay";

const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif";
const INK = "#10141b";
const PAPER = "#ffffff";

export interface Caption {
  name: string;
  facts: string;
  /** CSS colour before the name; none for the whole wall. */
  swatch: string | null;
}

type Pen = CanvasRenderingContext2D;

function box(pen: Pen, x: number, y: number, width: number, height: number, round: number): void {
  pen.beginPath();
  pen.roundRect(x, y, width, height, round);
}

function flag(pen: Pen, { word, x, y, kind }: Flag): void {
  pen.font = `620 12px ${FONT}`;
  pen.textBaseline = "middle";
  pen.textAlign = "center";
  const width = pen.measureText(word).width + 16;
  const down = kind === "top" ? -1 : 1;
  const middle = y + down * 21;
  pen.fillStyle = PAPER;
  pen.beginPath();
  pen.moveTo(x, y + down * 4);
  pen.lineTo(x - 6, y + down * 11);
  pen.lineTo(x + 6, y + down * 11);
  pen.fill();
  box(pen, x - width / 2 - 1.5, middle - 12.5, width + 3, 25, kind === "top" ? 13 : 7);
  pen.fill();
  pen.fillStyle = INK;
  box(pen, x - width / 2, middle - 11, width, 22, kind === "top" ? 12 : 6);
  pen.fill();
  pen.fillStyle = PAPER;
  pen.fillText(word, x, middle);
}

function caption(pen: Pen, { name, facts, swatch }: Caption, height: number, most: number): void {
  const [edge, tall] = [12, 52];
  const left = edge + (swatch ? 46 : 16);
  pen.textAlign = "left";
  pen.textBaseline = "alphabetic";
  pen.font = `620 16px ${FONT}`;
  let width = pen.measureText(name).width;
  pen.font = `13px ${FONT}`;
  width = Math.min(most - 2 * edge, left - edge + Math.max(width, pen.measureText(facts).width) + 16);
  const top = height - edge - tall;
  pen.fillStyle = INK;
  box(pen, edge, top, width, tall, 12);
  pen.fill();
  if (swatch) {
    pen.fillStyle = swatch;
    pen.strokeStyle = PAPER;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.arc(edge + 26, top + tall / 2, 11, 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
  }
  pen.fillStyle = PAPER;
  pen.font = `620 16px ${FONT}`;
  pen.fillText(name, left, top + 23, width - left);
  pen.font = `13px ${FONT}`;
  pen.fillText(facts, left, top + 41, width - left);
}

/** `drawn` is the picture of the wall; sizes and flags are in CSS pixels of the canvas. */
export async function composePicture(
  drawn: Blob,
  width: number,
  flags: Flag[],
  words: Caption,
): Promise<Blob | null> {
  const picture = await createImageBitmap(drawn);
  const paper = document.createElement("canvas");
  [paper.width, paper.height] = [picture.width, picture.height];
  const pen = paper.getContext("2d")!;
  pen.drawImage(picture, 0, 0);
  picture.close();
  const dense = paper.width / width;
  pen.scale(dense, dense);
  for (const one of flags) flag(pen, one);
  caption(pen, words, paper.height / dense, width);
  return new Promise((resolve) => paper.toBlob(resolve, "image/png"));
}
