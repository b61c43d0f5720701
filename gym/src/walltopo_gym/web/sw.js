const SHELL = ["/assets/Act-ZVBcxB3d.js","/assets/Act-lQK3Vr64.css","/assets/Editing-BBqO0eWK.css","/assets/Editing-DVy-HqZY.js","/assets/Embedded-BP6Owinv.css","/assets/Embedded-_mccdQyB.js","/assets/Field-BSEpVDY-.js","/assets/Form-CSB3awd1.js","/assets/GymFields-CrSOeKFK.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymPage-ClK93eAN.js","/assets/GymSettings-CQkHPuQ9.js","/assets/GymSettings-DrofGMTY.css","/assets/Invitation-D0hP3Pnq.js","/assets/Me-D80ME__m.js","/assets/Me-Dq9KQuUQ.css","/assets/MyData-DdOHhsdT.js","/assets/MyProfile--v8wEIBa.js","/assets/MyProfile-zTXHXW0-.css","/assets/NewGym-BS-NEotG.js","/assets/NewPassword-CWfiTsjZ.js","/assets/OwnPage-CLSXqvZU.js","/assets/PastPage-Bn3wuiTY.css","/assets/PastPage-sJ3te5DC.js","/assets/PersonPage-ByPN5uIb.css","/assets/PersonPage-C07qSgdW.js","/assets/Qr-BaWVYmFf.css","/assets/Qr-BhBp-DIc.js","/assets/ScanPage-BXLLD5_8.css","/assets/ScanPage-zV6GaXP2.js","/assets/Security-BgWZVzwS.js","/assets/Security-BnaykHIx.css","/assets/SignIn-CTmvNgRl.css","/assets/SignIn-DttdPcJw.js","/assets/SignInDevice-BkRoQcm7.css","/assets/SignInDevice-D4oR_67w.js","/assets/SignUp-CoPVZnu-.js","/assets/Versions-BnkG8heU.css","/assets/Versions-C90RNhIA.js","/assets/Wall3D-DuYpsgiv.js","/assets/Wall3D-JDl53coD.css","/assets/WallPage-Cd5Y722m.js","/assets/WallPage-CtQeSo1s.css","/assets/colours-Br08J5gd.js","/assets/cs-QQ7snLmE.js","/assets/de-4ReTm8jj.js","/assets/en-Ce29nQwH.js","/assets/esm-Ci1ogKuK.js","/assets/fr-Cm5HsxS5.js","/assets/index-C7yEAn65.js","/assets/index-Dn4iMZzI.css","/assets/lastGym.svelte-CDjJY3dG.js","/assets/passkeys-BsgV871U.js","/assets/roles-CjEB2poW.js","/assets/routes-Ca8zU6Dj.js","/assets/routes-DQS7rSjJ.css","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "faabccadd7a2";
// Above this the build writes SHELL, the app's own files, and VERSION, a name for them.
// The shell opens without reception; what it shows still comes from the server.

const CACHE = `shell-${VERSION}`;

self.addEventListener("install", (event) => {
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(["/", ...SHELL])));
  self.skipWaiting();
});

self.addEventListener("activate", (event) => {
  const drop = (names) => Promise.all(names.filter((name) => name !== CACHE).map((name) => caches.delete(name)));
  event.waitUntil(caches.keys().then(drop));
  self.clients.claim();
});

self.addEventListener("fetch", (event) => {
  const { request } = event;
  const { pathname, origin } = new URL(request.url);
  if (request.method !== "GET" || origin !== location.origin) return;
  if (request.mode === "navigate") {
    if (!pathname.startsWith("/api/")) event.respondWith(fetch(request).catch(() => caches.match("/")));
  } else if (SHELL.includes(pathname)) {
    event.respondWith(caches.match(request).then((kept) => kept ?? fetch(request)));
  }
});
