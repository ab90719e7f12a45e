//! The drone's video to browsers, by WebRTC.
