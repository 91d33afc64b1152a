// SPDX-License-Identifier: MIT
// Made by tests/bench/train_chunks.cpp; how to read it: PriorReader in chunk_statistics.h.
#pragma once
namespace rill::format {
inline constexpr char chunk_priors[] = R"(
WR.14V.7YW.6YXZ.5YWY.5aXYY.4bZaYW.3baaYW.3cabZXU.2dbcZXV.2ecdaYVS.feecZWT.hffdaXU.ifgebYVTjhhecZVWJ.7
R.7L.7SQ.6TR.6VR.6XTU.5YVV.5ZXWR.4aYXU.4caZVR.3cbaWR.3dbbYU.3eddaW.3fgebb.11VR.6YS.6VU.6YVV.5ZWWV.4aX
XU.4bZYU.4caZVU.3ebaWV.3fdcYVW.2gedaXWW.hffcZXYXjhgebYXWkiigdaYXnkkifcaXpnnkhfcZWY.22YY.6aZb.13caba.4
dcdbb.3ecdbaY.2fdecaZ.2gefdbZY.hfgecaYXiggecaYWkhhfdbZWlijgecaXnkligdbZZRW.5aUV.5cXY.5bVWT.4cXXV.4cYX
U.4dZZVS.3eaaWT.3ebaXT.3fcbYVQ.2gdcZWS.2heebXT.2hffcZWR.jggebYT.liigebWRmlljgeaW.128YZba.12U.7aYaZ.4b
abYX.3ZZa.5cbbZX.3dccZXW.2edcaXV.2fedaYWS.fedbYWS.gfecZWS.hgfdaXTQiigebYUQkjhgdaWSjljigcZ.WRU.5ZTU.5X
WV.5aVVT.4aXWT.4bYXU.4cZYVR.3daZVR.3dbaXSO.2ecbYUP.2fdcZVQ.2geeaWR.2hgfcYUO.ihgeaXR.ljhgdaW.265UdgdZX
U.ZXV.5bZW.5aYYYY.3abaYW.3daYV.4ccbYW.3cecYWV.2eedZWV.2egeaXU.2fhfbYVS.gigdZWS.gjieaXT.gjjgcZV.hlkjea
Y.9A.23K.7K.15K.7I.7J.7J.7J.7K.7K.7M.23dX.478b.7Z.263a.15cXRQ.4aba.5bX.6aY.6dYY.5eaZT.4fcaT.4gcbVN.3d
XN.5dXN.309jghfdaXNighfcaXN.368XadbZY.2WbdbZY.2ZbdbaX.2cdecaYa.feecaYYVhefdaZZYkhhfdbaZWT.6UU.6VV.6WV
.6YX.6Y.15YUW.5XVW.5YWX.5ZXY.5aZaY.4cbbY.4fddb.4ZVX.5YWWU.4ZXXT.4aXYV.4bZZX.4dbbZ.4fddbc.3bXXU.4aYYV.4
bYYV.4bZZWT.3caaYW.3dbbZX.3geebaa.2dZZWW.3caZWV.3caaXU.3dbaXV.3ebbYWV.2fdcZXW.2hffcaZX.fccaYX.2eddbZX
V.fddbYX.2gedbYXV.geebZXWQhffcaYWSkiifcaYWgfgfdbZX.48aUX.53cXZZa.51cXZYYY.50eaZYYX.50fcbZYXW.49iffdbZ
XW.48cddbZWQ.ZbdcaYV.bddbaYU.dfecaYU.gggdbYT.hihfcZUQkjjgeaWSZUV.5YWW.5aYX.5aYZ.5bb.22bXYXX.3aXXW.4bZ
ZX.4caZY.4dddZ.4hffd.12cYYWU.3bYYV.4caZW.4dbaXV.3ecaZW.3fefbY.11daZXVU.2caZWT.3dbaWU.3ecaXV.3fdcZWV.2
geebYU.2jggc.4fcbYUS.2ecbYU.3fdcYV.3fecZVT.2gedaWU.2hgfbYU.2jigebY.2hfeaXS.2hfebYT.2hgebXU.2hffbYUQ.i
gfcYUS.ihgdZVR.jihebYVTLfhdaXVU.48ZXW.53cZZZY.51cZZXW.51ecbXWT.50gfcZVT.50jhgcZWU.49eYX.389lmmmmlW.41
cfhgihV.369nmhX.4mgcU.4gcaP.4dYW.5cXRQ.4dXX.5gcZO.4ngcU.4mmhX.60dXN.237abedcc.2cbedbb.2fdedbaY.gefdba
XPhggebZXPighfcZWOkhigdaXN.336c.7Ze.14a.7aa.30YXbbaV.2YZaZXXVSYZbZYWURZYZ.5aZaZY.3aZba.4aXc.5bZaZY.3b
Zba.4bZaY.4caaZX.3daaZZ.3daaYV.3ebbZYX.2fccaZY.2fccZWR.2gddaYXT.hddbZYW.gedaWS.2ifecZWU.iffdaYXVjggdZ
WWVlihfcZYXmkjhecaY.72c.55fdecaYU.fbcaYXXUdabaZYVTb.7ebca.4YZd.5db.6ecdb.4ZZ.6dbb.5fcdaY.3bbdc.4ecca.4
gddbZW.2ecedba.2fddcZ.3heecZX.2hdedbaX.hefcaX.2iffdaYW.ifgdcZX.kihfcaWSliigebZWnkkhfcaY.56bZ.6bXX.5ZU
WT.4dcbZX.3caZXU.3aXXUT.3dcbaY.3cbaYUS.2bZZWT.3efdaYX.2dcbYWR.2caZXUP.2egdbZV.2eccZWR.2dbaYUT.2ehdbZW
P.eedaXT.2eccZVT.2fgecZWQ.ffebYUQ.eddaXTU.fhecaZVOhgfdaXUQgggdaXTR.320E.7A.7A.7ZlkjdU.2agfcYWT.ZccaYW
VU.80dYW.317cfhhiiV.Yb.502cXRQ.4aba.5bX.6aY.6dYY.5eaZT.4fcaT.4gcbVN.11dXN.61Zacb.4bbed.4ededba.2hefdb
aY.iggdbZXPihhfcZWOkhigdaXO.8Zbcb.4cbfda.3fcedcZ.2gefdbaX.iggebZWPihhfcZXNkiigdaXN.192VVYW.4VVXW.4XXY
WT.3ZYYWVV.2baaXVT.2eddbZXVSaV.6ZW.6aX.6bYZ.5cZZX.4edcbZZW.bY.6bV.6cW.6cXZ.5dZaX.4fddbaYW.bY.6cX.6cX.6
dYa.5eabY.4gdebaYW.dab.5dZb.5eZb.5eabZ.4gbbZW.3heecaYXWfcca.4fbcY.4ebb.5fccaX.3gdcaX.3iffdbZXVhdebW.3
gdeb.4hdea.4gedbY.3heeaYV.2jggebZYVkghdbZ.2jggdcZ.2jghdbZ.2jhgebZb.khhebZZWmjjgebaYaXZYXY.2cXZXWV.2ea
aYWW.2fbbYWV.2gddaXWP.iggdbYWUabda.4bZ.6fb.6fbc.5gdcZ.4jgfdbY.2cbec.4f.15ec.6hddZ.4jggdbY.2ebecb.3eb.6
fa.6fde.5gffa.4jggebZX.gcecbZ.2gc.6fc.6gdeb.4hfecY.3jggebZX.ifedcaX.h.7he.6iffc.4igfda.3kihfcaXWjhgdb
aYX.16jgid.4ihhdb.3ljigdaYVnkkhecaXih.14jihfb.3kiifca.2ollifcZXYSU.5ZTU.5bXV.5caX.5eca.13ZYaZY.3aWXV.4
bYXV.4caZWV.3edbYV.3hfebXU.2aYaZYT.2aXXV.4bYXV.4caZVT.3ecbYU.3gfebYV.2babaYS.2bYYW.4cZYW.4dbaWU.3edbY
V.3hfebYV.2ccbaZW.2cZZW.4caZXV.3dbaXV.3fdcYVU.2hfebYVU.dddbZW.2cabYX.3dbbYW.3ecbYWV.2fdcZWU.2hgfcYVU.
ffebZWS.dccaX.3eccaY.3fdcaXW.2fedaXW.2hgfcZWU.hgfdaWQ.gfedaY.2gfecaYU.hffcaYU.hgfcaYT.ihgdaYVRL.7Z.39
OYY.5bYX.5daZX.4fdbW.4iffZ.4lihgZ.3NYZa.4bZYX.4eaZX.4fdbXV.3igeaS.3kjhea.3OaaX.4caZX.4ebZX.4gdbX.4ige
ZT.3jhieZ.3Nbba.4daaY.4ecaX.4gebXV.3jhgaT.3jjjeaW.2OedbY.3eccZ.4fdbY.4gecYV.3ihfaV.3jihfaW.2OhgdZ.3fc
ea.4hecb.4hfdZW.3jgfbW.3jjhfaW.2SjieaYV.igebZ.3hfecZ.3ihgbYV.2jigcXU.2ljjgcXV.dX.382kmmmmlW.33cffghhV
.337dZXUM.3dXN.373jghfdaXN.40gfgfcZT.hfgecZU.hfgdbYV.iggebZV.ihhecZWOkiigebYN.291YYYXXXW.17YYYYXWV.17
YYXWU.19ZYWWW.46Y.20XO.22ZZYYVO.23USP.31eZ.7gcZ.6iebZ.5kgdba.4khfcba.3kigecbb.2kkhfddcb.2MLMOP.11SRRS
T.27acXbaYYZaZYWXWQ.adWaaYY.2bYYY.3bdY.bYY.9bcX.13d.46ZZZZZZZaZZZZZZZZZZZZZZZZZZYXYYZZZZZaaaaZXVWXYZa
bbcba.26ZZZYXXZZYXV.ZYXXTNYYYXVRYZYYX.ZZZYY.ZZZZZYaZaaZ.aaaaa.Zaaab.aaaac.aaaaa.aZaZaZYYZZZZXYYYY.WXY
YX.XYYYV.YYZYUPYYZZZ.ZZZaZZaZZa.2aaaZc.baaZY.aaaab.baaZ.2aaaZZZXYZZZZXYYXVVYYYYWTYZZZXVZZZZY.aaaaa.aa
aabcaaaaa.aaaZZZ.25Yebe.8Xbdd.10gcfdebbYZWWWW.3kfkijijhjhkieR.AA.W.3aN.6aaXM.12daZaZWM.25qaaYZaYaaaWa
M.52AA.M.3UL.6XXX.13YYYZYY.26ZZZZZZZZZZZ.53tu.dgebc.eilhf.ehloi.dgjmo.dfhkp.efhkp.edfip.bbefp.Ybcdp.Z
ehhp.ehinq.iglmttnljiabcdfdfffgeiiiihjkllp.2ms.42oqppoonnllnqZcddeeebbcfkcfiiijhfcegneillllkjhhioglnn
nnnnllmpjprrrqqqpppt.61tmkhhhiiiig.beddd.egifg.egjmh.egilm.dfhjn.ecgjo.ddeho.dbeho.ccdgo.bcfgo.bbfio.
dadfqgpoonabcegdfgghfjjijhmlmoo.lnt.42dhjklkklklllYcdeeeeedcbibfhjkkjjigendilmmnnmlkkpgmooooooonmqlpq
rqqqpppps.UZZabbcccec.cdeefffgfgf.giijijjkkkj.illllllklkk.oqppppooooo.372m.215mefbjefdhdecidgdjehfjfh
fhgggfgfffcefhedgfddegdefgdffgegegfgfffgfiecdhegffegegfgehghegggfgggggggghfidffegfffgfffgggfgffgfgggg
ggggggggggggggggggggggggggggggggggggggggggggggggggggggggggggggggggggdfeeeheefhfffgfgggggggggggggggggd
edddddddddedddedddeeedeeeefggggddcddccdedcfeghaegfggggggggg.lpn.aup.9n.14
)";
}  // namespace rill::format
