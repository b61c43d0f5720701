/** Whether a response is the page of a captive portal: the API answers no request with HTML. */
export function isPortal(response: Response): boolean {
  return /^text\/html/.test(response.headers.get("content-type") ?? "");
}
