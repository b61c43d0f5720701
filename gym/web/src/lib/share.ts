/** Shares an address by the phone's share sheet if it has one, else copies it. */
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
