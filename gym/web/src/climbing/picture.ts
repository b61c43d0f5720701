/** A session as a picture to share: drawn here, sent nowhere. */

export interface Picture {
  gym: string;
  day: string;
  name: string;
  /** Large figures with what they mean. */
  figures: { value: string; label: string }[];
  /** Tops by grade, the hardest first. */
  grades: { label: string; count: number }[];
}

const SIZE = { width: 1080, height: 1350 };
const MARGIN = 84;
const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif";
const INK = "#eef2f9";
const QUIET = "#a9b6cb";
const BAR = "#8ab4ff";
const MAX_GRADES = 8;

/** As PNG. */
export async function draw(result: Picture): Promise<Blob> {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, SIZE);
  const pen = canvas.getContext("2d")!;
  ground(pen);
  write(pen, result.gym, MARGIN, 150, 64, 700, INK);
  write(pen, [result.name, result.day].filter(Boolean).join(" · "), MARGIN, 215, 36, 400, QUIET);
  figures(pen, result.figures);
  pyramid(pen, result.grades.slice(0, MAX_GRADES));
  write(pen, "walltopo", MARGIN, SIZE.height - 66, 32, 600, QUIET);
  return new Promise((resolve, reject) => {
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser drew nothing"))), "image/png");
  });
}

function ground(pen: CanvasRenderingContext2D): void {
  const shade = pen.createLinearGradient(0, 0, SIZE.width, SIZE.height);
  shade.addColorStop(0, "#1a2740");
  shade.addColorStop(1, "#0c1220");
  pen.fillStyle = shade;
  pen.fillRect(0, 0, SIZE.width, SIZE.height);
}

/** A line of text, smaller where it would not fit. */
function write(
  pen: CanvasRenderingContext2D, text: string, x: number, y: number, size: number, weight: number, colour: string,
  room = SIZE.width - MARGIN - x,
): void {
  pen.font = `${weight} ${size}px ${FONT}`;
  const wide = pen.measureText(text).width;
  if (wide > room) pen.font = `${weight} ${Math.floor((size * room) / wide)}px ${FONT}`;
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
}

function figures(pen: CanvasRenderingContext2D, result: Picture["figures"]): void {
  const room = (SIZE.width - 2 * MARGIN) / 2;
  result.slice(0, 4).forEach(({ value, label }, place) => {
    const x = MARGIN + (place % 2) * room;
    const y = 390 + Math.floor(place / 2) * 200;
    write(pen, value, x, y, 108, 750, INK, room - 30);
    write(pen, label, x, y + 48, 32, 400, QUIET, room - 30);
  });
}

function pyramid(pen: CanvasRenderingContext2D, grades: Picture["grades"]): void {
  const most = Math.max(1, ...grades.map(({ count }) => count));
  const high = Math.min(84, 460 / Math.max(1, grades.length));
  const left = MARGIN + 150;
  grades.forEach(({ label, count }, place) => {
    const y = 740 + place * high;
    write(pen, label, MARGIN, y + high * 0.45 + 12, 34, 600, INK, 135);
    pen.fillStyle = BAR;
    pen.beginPath();
    pen.roundRect(left, y + high * 0.12, ((SIZE.width - MARGIN - left - 80) * count) / most, high * 0.66, 8);
    pen.fill();
    write(pen, String(count), left + ((SIZE.width - MARGIN - left - 80) * count) / most + 18, y + high * 0.45 + 12, 34, 400, QUIET, 80);
  });
}

/** Shares a picture by the phone's share sheet if it accepts files, else saves it. */
export async function handOn(picture: Blob, name: string, title: string): Promise<void> {
  const file = new File([picture], name, { type: "image/png" });
  if (navigator.canShare?.({ files: [file] })) {
    try {
      await navigator.share({ files: [file], title });
      return;
    } catch (error) {
      if (error instanceof DOMException && error.name === "AbortError") return;
    }
  }
  const link = document.createElement("a");
  link.href = URL.createObjectURL(picture);
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}
