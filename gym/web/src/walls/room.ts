/** Links by which a phone shows a wall in the room around it: Apple's Quick Look and Android's Scene Viewer. */

/** The addresses of a version's two files; null if it was scanned before there were any. */
export function roomFiles(files: Record<string, string>): { usdz: string; glb: string } | null {
  const [usdz, glb] = [files["page/ar.usdz"], files["page/ar.glb"]];
  return usdz && glb ? { usdz, glb } : null;
}

/** Whether this browser opens USDZ files in Quick Look. */
export function hasQuickLook(): boolean {
  return document.createElement("a").relList.supports("ar");
}

export function hasSceneViewer(): boolean {
  return /Android/.test(navigator.userAgent);
}

/** The address that opens a GLB in Scene Viewer, or `page` where that app is missing. The viewer is no browser: it has no sign-in. */
export function sceneViewerLink(glb: string, title: string, page: string): string {
  const query = new URLSearchParams({ file: glb, mode: "ar_preferred", title });
  const parts = ["scheme=https", "package=com.google.android.googlequicksearchbox", "action=android.intent.action.VIEW"];
  return `intent://arvr.google.com/scene-viewer/1.0?${query}#Intent;${parts.join(";")};S.browser_fallback_url=${encodeURIComponent(page)};end;`;
}
