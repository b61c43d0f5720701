/** Hands an address on: by the phone's own sheet where there is one, else into the clipboard. */
export async function share(title: string, url: string): Promise<"shared" | "copied" | "not"> {
  if (navigator.share) {
    try {
      await navigator.share({ title, url });
      return "shared";
    } catch (error) {
      if (error instanceof DOMException && error.name === "AbortError") return "not";
    }
  }
  await navigator.clipboard.writeText(url);
  return "copied";
}
