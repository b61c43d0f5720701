/** The browser's languages, most wanted first, without entries that are no language tags: WebKit calls the locale C of a Linux system "C", with which `Intl` throws. */
export function browserLanguages(): string[] {
  return navigator.languages.filter(isTag);
}

function isTag(text: string): boolean {
  try {
    return Intl.getCanonicalLocales(text).length === 1;
  } catch {
    return false;
  }
}
