(* What Okajima, Hosoe and Hagiwara print: the plant of Sec. IV-A and the gains (33), (38), (39) and (40).
   Copied by hand from the paper; certificates use them and hold no plant of their own. *)
From mathcomp Require Import ssreflect seq.
From Coq Require Import QArith_base.
From Multirate Require Import Statement.
Local Open Scope Q_scope.

Definition stable := Plant
  (* A   *) [:: [:: 0.95; 0.5; 0.2]; [:: -0.1; 0.9; -0.2]; [:: 0; 0.1; 0.85]]
  (* B_u *) [:: [:: 0; 1]; [:: 2; 0]; [:: 0.5; 2]]
  (* B_d *) [:: [:: 0.1]; [:: 0.3]; [:: 0.2]]
  (* C   *) [:: [:: 1; 0.5; 0]; [:: 1; 2.5; 0.2]]
  (* D   *) [:: [:: 1; 0]; [:: 0; 0.5]]
  (* W   *) [:: [:: 1; 0; 0]; [:: 0; 1; 0]; [:: 0; 0; 1]].

Definition unmeasured : table := [:: [:: 0; 0]; [:: 0; 0]; [:: 0; 0]].

Definition gains_33 : seq table := [::
  [:: [:: 0.228; 0.294]; [:: -0.125; 0.267]; [:: 0.084; 0.110]];
  unmeasured;
  [:: [:: 0.356; 0]; [:: 0.099; 0]; [:: 0.160; 0]];
  [:: [:: 0; 0.341]; [:: 0; 0.245]; [:: 0; 0.128]];
  [:: [:: 0.227; 0]; [:: -0.065; 0]; [:: 0.101; 0]];
  unmeasured].

Definition gains_38 : seq table := [::
  [:: [:: 0.276; 0.248]; [:: -0.166; 0.307]; [:: 0.113; 0.076]];
  unmeasured;
  unmeasured].

Definition gains_39 : seq table := [::
  [:: [:: 0.348; 0]; [:: 0.083; 0]; [:: 0.155; 0]];
  [:: [:: 0; 0.315]; [:: 0; 0.265]; [:: 0; 0.111]];
  unmeasured].

Definition gains_40 : seq table := [::
  [:: [:: 0.246; 0]; [:: -0.099; 0]; [:: 0.111; 0]];
  unmeasured;
  [:: [:: 0; 0.342]; [:: 0; 0.248]; [:: 0; 0.119]]].

(* The plant that each of these gains is for. *)
Definition gains_33_plant := stable.
Definition gains_38_plant := stable.
Definition gains_39_plant := stable.
Definition gains_40_plant := stable.
