// When a browser is shown stills in place of video.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Decoder, STUCK_MS, hasH264, takesH264 } from "../app/pure/decoding.js";

test("a browser has H.264 when it says so, or says nothing", () => {
  const codecs = (...types) => ({ codecs: types.map((mimeType) => ({ mimeType })) });
  assert.equal(hasH264(codecs("video/VP8", "video/H264", "video/rtx")), true);
  assert.equal(hasH264(codecs("video/VP8", "video/H265", "video/rtx")), false);
  assert.equal(hasH264({ codecs: [] }), false);
  for (const silent of [undefined, null, {}]) assert.equal(hasH264(silent), true);
});

test("an answer takes H.264 by its rtpmap alone", () => {
  assert.equal(takesH264("v=0\r\nm=video 9 UDP/TLS/RTP/SAVPF 102\r\na=rtpmap:102 H264/90000\r\n"), true);
  assert.equal(takesH264("m=video 0 UDP/TLS/RTP/SAVPF 102\r\na=msid-semantic: H264/\r\n"), false);
  assert.equal(takesH264(undefined), false);
});

test("a decoder is stuck when video comes for a while and no picture", () => {
  const decoder = new Decoder();
  const feed = (bytesReceived, framesDecoded, now) => decoder.isStuck({ bytesReceived, framesDecoded }, now);
  assert.equal(feed(0, 0, 0), false);
  assert.equal(feed(1000, 0, 1000), false);
  assert.equal(feed(2000, 0, 1000 + STUCK_MS - 1), false);
  assert.equal(feed(3000, 0, 1000 + STUCK_MS), true);
  assert.equal(feed(4000, 1, 2000 + STUCK_MS), false, "a picture");
  assert.equal(feed(5000, 1, 3000 + STUCK_MS), false, "counted anew");
  assert.equal(feed(5000, 1, 20_000), false, "nothing comes: the line's fault");
  assert.equal(feed(6000, 1, 21_000), false);
  assert.equal(feed(undefined, undefined, 40_000), false);
});
