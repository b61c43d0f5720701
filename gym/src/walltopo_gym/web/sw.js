const SHELL = ["/assets/Account-C2G7e_84.js","/assets/Act-EeKS-cyv.js","/assets/Act-lQK3Vr64.css","/assets/Editing-BBqO0eWK.css","/assets/Editing-CITIHFze.js","/assets/Embedded-BP6Owinv.css","/assets/Embedded-D4hYBCs2.js","/assets/Field-CBjWmque.js","/assets/Form-B_lAj8MO.js","/assets/GymFields-DMgwR4R6.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymPage-C1xExV3P.js","/assets/GymSettings-DtdFeEdR.css","/assets/GymSettings-EHihnM9D.js","/assets/Invitation-B7v1Is3K.js","/assets/NewGym-DMZ03KIc.js","/assets/NewPassword-nqLa7TnK.js","/assets/ScanPage-CQ7EXzXm.js","/assets/ScanPage-CSN7mRFf.css","/assets/SignIn-CoXFLE9N.js","/assets/SignUp-BZkDMxua.js","/assets/Versions-BceTL_O6.js","/assets/Versions-BnkG8heU.css","/assets/Wall3D-D6Nsuaim.js","/assets/Wall3D-JDl53coD.css","/assets/WallPage-CtQeSo1s.css","/assets/WallPage-DL4ASyEy.js","/assets/colours-CV1EUFyl.js","/assets/cs-DRfkPrvF.js","/assets/de-Dg7nreK2.js","/assets/en-BNby_9_v.js","/assets/fr-DcW0XQiq.js","/assets/index-CJvyrZyn.js","/assets/index-Dn4iMZzI.css","/assets/lastGym.svelte-9u_L9bom.js","/assets/roles-CjEB2poW.js","/assets/routes-DQS7rSjJ.css","/assets/routes-bx8V4Gm8.js","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "9dad4540ec7e";
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
