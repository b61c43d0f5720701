/** Short addresses of routes: the code is the first 50 bits of the id, as `walltopo_gym/publishing/codes.py` has it. */

const LETTERS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";
const LENGTH = 10;

export function codeOf(route: string): string {
  const number = BigInt(`0x${route.replaceAll("-", "")}`) >> BigInt(128 - 5 * LENGTH);
  return Array.from({ length: LENGTH }, (_, place) => LETTERS[Number((number >> BigInt(5 * (LENGTH - 1 - place))) & 31n)]).join("");
}

export function shortAddress(route: string): string {
  return `${location.origin}/r/${codeOf(route)}`;
}

/** A code as it may be typed from a card. */
export function spelt(code: string): string {
  return code.toUpperCase().replaceAll("-", "").replaceAll("I", "1").replaceAll("L", "1").replaceAll("O", "0");
}
