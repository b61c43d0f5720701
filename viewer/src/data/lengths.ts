/** Lengths in metres as people read them: in metric units, or in feet and inches. */

import { numberFormat } from "./numbers";

export type Units = "metric" | "imperial";

/** `code`: of the language. */
export interface Measures {
  units: Units;
  code: string;
}

/** In metres. */
export const INCH = 0.0254;

/** "1.75 m" with at least and at most so many decimals; "5 ft 9 in", or "9.5 in" below a yard. */
export function inMetres(metres: number, { units, code }: Measures, least = 2, most = least): string {
  if (units === "metric") return `${decimals(code, least, most).format(metres)} m`;
  if (metres < 0) return `-${inMetres(-metres, { units, code })}`;
  const inches = Math.round(metres / INCH);
  if (inches < 36) return inUnit(metres / INCH, "inch", code, inches < 12 ? 1 : 0);
  return feet(inches, code, 0);
}

/** "45 cm" with at most so many decimals; "18 in". */
export function inCentimetres(metres: number, { units, code }: Measures, most = 0): string {
  if (units === "imperial") return inUnit(metres / INCH, "inch", code, most);
  return `${decimals(code, 0, most).format(metres * 100)} cm`;
}

/** A measured length: "0.453 m", "4.03 m"; "17.8 in", "13 ft 2.7 in". */
export function measured(metres: number, { units, code }: Measures): string {
  if (units === "metric") return inMetres(metres, { units, code }, metres < 1 ? 3 : 2);
  const inches = Math.round(metres / INCH * 10) / 10;
  return inches < 36 ? inUnit(inches, "inch", code, 1) : feet(inches, code, 1);
}

function feet(inches: number, code: string, most: number): string {
  const whole = Math.floor(inches / 12);
  return `${inUnit(whole, "foot", code, 0)} ${inUnit(inches - 12 * whole, "inch", code, most)}`;
}

function inUnit(value: number, unit: "foot" | "inch", code: string, most: number): string {
  return numberFormat(code, { style: "unit", unit, maximumFractionDigits: most }).format(value);
}

function decimals(code: string, least: number, most: number): Intl.NumberFormat {
  return numberFormat(code, { minimumFractionDigits: least, maximumFractionDigits: most, useGrouping: false });
}
