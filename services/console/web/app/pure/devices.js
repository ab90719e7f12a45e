// Telling a device to trust the page: by which address it is reached, and the fingerprint in groups.

const OWN = /^(localhost|127(\.\d{1,3}){3}|\[::1\])$/;

/** Whether only this machine itself reaches `hostname` (as `location.hostname` writes it). */
export function isOwnMachine(hostname) {
  return OWN.test(hostname);
}

/** The groups of a fingerprint; empty for what is none. */
export function groups(fingerprint) {
  const words = typeof fingerprint === "string" ? fingerprint.split(" ") : [];
  return words.length === 16 && words.every((word) => /^[0-9A-F]{4}$/.test(word)) ? words : [];
}
