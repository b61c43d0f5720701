/** This browser as a source of score events: its id, and the number of its events. */

const NAME = "walltopo-device";
const COUNT = "walltopo-device-count";

export function stamp(): { device: string; number: number; made_at: string } {
  const device = localStorage.getItem(NAME) ?? crypto.randomUUID();
  const number = Number(localStorage.getItem(COUNT) ?? 0) + 1;
  localStorage.setItem(NAME, device);
  localStorage.setItem(COUNT, String(number));
  return { device, number, made_at: new Date().toISOString() };
}
