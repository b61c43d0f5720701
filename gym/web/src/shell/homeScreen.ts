/** Whether to suggest the Home Screen: iOS has no install prompt, and deletes what an app stored that was not opened for a week. */

const KEPT = "walltopo-home-screen";

/** Only Safari on iOS has `standalone`: true when opened from the Home Screen. */
export function isSuggested(browser: { standalone?: boolean } = navigator as { standalone?: boolean }): boolean {
  return browser.standalone === false && localStorage.getItem(KEPT) === null;
}

export function dismiss(): void {
  localStorage.setItem(KEPT, "dismissed");
}
