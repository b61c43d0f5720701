// Asks for the first tier while the viewer's script is still on its way.
if (location.protocol !== "file:") {
  const link = document.createElement("link");
  link.rel = "preload";
  link.as = "fetch";
  link.crossOrigin = "anonymous";
  link.href = document.currentScript.src.replace(/start\.js$/, "first.glb");
  document.head.append(link);
}
