// Asks for the first tier and its labels while the viewer's script is still on its way.
if (location.protocol !== "file:") {
  for (const file of ["first.glb", "labels.json"]) {
    const link = document.createElement("link");
    link.rel = "preload";
    link.as = "fetch";
    link.crossOrigin = "anonymous";
    link.href = document.currentScript.src.replace(/start\.js$/, file);
    document.head.append(link);
  }
}
