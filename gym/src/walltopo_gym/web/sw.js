const SHELL = ["/assets/Act-BdJjvzFp.js","/assets/Act-lQK3Vr64.css","/assets/Editing-BBqO0eWK.css","/assets/Editing-BFapuYOD.js","/assets/Embedded-BP6Owinv.css","/assets/Embedded-igGOPeNO.js","/assets/Field-D9PTVkVT.js","/assets/FloorPlan-7_N6MPPV.js","/assets/FloorPlan-jatgWKTX.css","/assets/Form-ByzsXgZX.js","/assets/GymFields-tM5C2I8j.js","/assets/GymPage-DOlrudE-.js","/assets/GymPage-Npe-Pm2Q.css","/assets/GymSettings-BvQAn1nL.css","/assets/GymSettings-PZIswMCO.js","/assets/Invitation-BHhogL9M.js","/assets/Links-DbZxsz6i.js","/assets/Links-Dq9KQuUQ.css","/assets/Log-CHJKI15o.css","/assets/Log-RpdUTzEv.js","/assets/Me-DtTbYEX_.js","/assets/MyData-Dc9i8SMX.js","/assets/MyProfile-CzhWLxSz.js","/assets/MyProfile-zTXHXW0-.css","/assets/NewGym-C3ynnkVU.js","/assets/NewPassword-B_is_kb5.js","/assets/Once-BcGRJjer.js","/assets/Once-CQrA9aUu.css","/assets/OwnPage-BzY8iK6j.js","/assets/PastPage-BJXN-W9S.js","/assets/PastPage-Bn3wuiTY.css","/assets/People-C3-D2WTb.css","/assets/People-mwQ0dPko.js","/assets/PersonPage-BCWT_vuo.js","/assets/PersonPage-ByPN5uIb.css","/assets/PlanEditor-CbsGLDaa.css","/assets/PlanEditor-D4Kfliyp.js","/assets/Qr-BaWVYmFf.css","/assets/Qr-D79ag_Nx.js","/assets/Reports-BNURpKvq.css","/assets/Reports-C1_SDIhe.js","/assets/ScanPage-BXLLD5_8.css","/assets/ScanPage-Tww1-PeO.js","/assets/Security-Bq08ON5_.css","/assets/Security-DzzgYPEM.js","/assets/SettingsPage-D2EAc-pT.js","/assets/SignIn-CTmvNgRl.css","/assets/SignIn-u_6vFrBS.js","/assets/SignInDevice-BkRoQcm7.css","/assets/SignInDevice-CqPVEUWp.js","/assets/SignUp-BBRnHpb4.js","/assets/Versions-BGXeNuhP.js","/assets/Versions-BnkG8heU.css","/assets/Wall3D-JDl53coD.css","/assets/Wall3D-y3KA0JQD.js","/assets/WallPage-CtQeSo1s.css","/assets/WallPage-DXxnVM6g.js","/assets/Webhooks-CkE9Nawf.css","/assets/Webhooks-Cm-iessi.js","/assets/Zones-BONtCXcd.css","/assets/Zones-Bix4gWbe.js","/assets/colours-TSDe-VVN.js","/assets/cs-C5-xClk4.js","/assets/de-DRct2Wci.js","/assets/en-BRIrnUQ7.js","/assets/esm-Ci1ogKuK.js","/assets/fr-DwlUW4DL.js","/assets/index-CTa10JU3.js","/assets/index-Dn4iMZzI.css","/assets/lastGym.svelte-JQRGF8Cv.js","/assets/passkeys-Ap3fam1M.js","/assets/roles-CjEB2poW.js","/assets/routes-DQS7rSjJ.css","/assets/routes-DS_QzhQq.js","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "a2c073af4fd5";
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
