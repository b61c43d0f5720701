const SHELL = ["/assets/Act-BswyXxQO.js","/assets/Act-lQK3Vr64.css","/assets/Editing-BBqO0eWK.css","/assets/Editing-cucX6g_M.js","/assets/Embedded-BP6Owinv.css","/assets/Embedded-CXW1zSMM.js","/assets/Field-jl683TaQ.js","/assets/Form-BOHrqKQO.js","/assets/GymFields-D8jR6k14.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymPage-CmM9PZQm.js","/assets/GymSettings-D4tk3M19.js","/assets/GymSettings-DrofGMTY.css","/assets/Invitation--6Rqtz-_.js","/assets/Me-Cm2Rk1WC.js","/assets/Me-Dq9KQuUQ.css","/assets/MyData-B21yU8d3.js","/assets/MyProfile-C2wehb1k.js","/assets/MyProfile-zTXHXW0-.css","/assets/NewGym-CX2l4cFS.js","/assets/NewPassword-W9HUkmRV.js","/assets/OwnPage-CxVdU-yf.js","/assets/PastPage-Bn3wuiTY.css","/assets/PastPage-oRsC4-1J.js","/assets/PersonPage-ByPN5uIb.css","/assets/PersonPage-D5vmfiqT.js","/assets/Qr-BaWVYmFf.css","/assets/Qr-z3svpG4t.js","/assets/ScanPage-BhmV9JnP.js","/assets/ScanPage-CSN7mRFf.css","/assets/Security-BnaykHIx.css","/assets/Security-D7D0WsjC.js","/assets/SignIn-CTmvNgRl.css","/assets/SignIn-DbjocV2M.js","/assets/SignInDevice-BkRoQcm7.css","/assets/SignInDevice-CbOZoXYR.js","/assets/SignUp-BTYT4dED.js","/assets/Versions-BnkG8heU.css","/assets/Versions-CnL_lqXH.js","/assets/Wall3D-C7C6QsHu.js","/assets/Wall3D-JDl53coD.css","/assets/WallPage-BAye0fzj.js","/assets/WallPage-CtQeSo1s.css","/assets/colours-D65CvLBm.js","/assets/cs-TuuOSCG1.js","/assets/de-BP8rb0wZ.js","/assets/en-BdTS7EVr.js","/assets/esm-Ci1ogKuK.js","/assets/fr-DGq1JN95.js","/assets/index-CYW9X92J.js","/assets/index-Dn4iMZzI.css","/assets/lastGym.svelte-v5L09ylZ.js","/assets/passkeys-BPQYR8qU.js","/assets/roles-CjEB2poW.js","/assets/routes-C6FL2wpC.js","/assets/routes-DQS7rSjJ.css","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "41867831a93e";
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
