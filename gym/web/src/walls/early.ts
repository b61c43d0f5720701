/**
 * A script of its own that runs before the app's: if the page opens on the last visited wall, it loads that wall while
 * the app still loads.
 */

import { lastWall, loadViewer } from "./script";

interface Viewer {
  expect(src: string): void;
}

const last = lastWall(location.pathname);
if (last) {
  window.wallViewer = loadViewer();
  const read = (): void => (customElements.get("wall-topo") as unknown as Viewer).expect(`${last.base}/page/first.glb`);
  window.wallViewer.then(read, () => undefined);
}
