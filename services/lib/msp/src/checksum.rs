//! The two check bytes.

/// XOR of all bytes: version 1.
#[must_use]
pub fn xor(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum ^ byte)
}

/// CRC-8 with the generator polynomial 0xD5 of DVB-S2 (EN 302 307, 5.1.4), start value 0: version 2.
#[must_use]
pub fn crc8_dvb_s2(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| TABLE[usize::from(crc ^ byte)])
}

const TABLE: [u8; 256] = {
    let mut table = [0; 256];
    let mut index = 0;
    while index < 256 {
        let mut crc = index as u8;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x80 == 0 { crc << 1 } else { (crc << 1) ^ 0xd5 };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
};
