:- module(planner_settling,
          [ settle/4,                   % +Program, +Situation, -Program, -Situation
            advance/5                   % +Ended, +Program, +Situation, -Program, -Situation
          ]).

/** <module> All that may begin now, along a guide

After something has ended, most of a large program is as it was. Only the branch in which it ended can
go on, and what the robots that are idle now are to do next. Where a program waits for what happens in
another branch (planner_influence:waits/2), all of it is looked at.
*/

:- use_module(library(lists)).
:- use_module(library(assoc)).
:- use_module(library(ordsets)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts), [definition/4, recursive/2]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(transition)).

%!  settle(+Program, +Situation, -Rest, -Next) is det.
%
%   Takes every transition that needs no time and leaves no choice: what has ended is left behind, and
%   composite processes whose body is done end.

settle(P, S, Rest, S1) :-
    settle(P, all, S, Rest, S1, _).

%   Ended: the step that has ended, or `all` to look everywhere. Exposed = true if something in a sequence
%   is next that was not before.
settle([P|Ps], Ended, S, Rest, S1, Exposed) :- !,
    settle(P, Ended, S, P1, S0, Exposed0),
    (   P1 == []
    ->  (   Ps == [] -> Rest = [], S1 = S0, Exposed = Exposed0
        ;   Exposed = true, settle(Ps, all, S0, Rest, S1, _)
        )
    ;   Ps == []
    ->  Rest = P1, S1 = S0, Exposed = Exposed0      % else every turn of a loop would nest one deeper
    ;   Rest = [P1|Ps], S1 = S0, Exposed = Exposed0
    ).
settle(conc(Ps), Ended, S, Rest, S1, Exposed) :- !,
    settle_all(Ps, Ended, S, Ps1, S1, false, Exposed),
    ( Ps1 == [] -> Rest = [] ; Rest = conc(Ps1) ).
settle(pconc(Ps), Ended, S, Rest, S1, Exposed) :- !,
    settle_all(Ps, Ended, S, Ps1, S1, false, Exposed),
    ( all_interrupts(Ps1) -> Rest = [] ; Rest = pconc(Ps1) ).
settle(picked(Id, Pick, P), Ended, S, Rest, S1, Exposed) :- !,
    settle(P, Ended, S, P1, S1, Exposed),
    ( P1 == [] -> Rest = [] ; Rest = picked(Id, Pick, P1) ).
settle(deadline(Ms, P), Ended, S, Rest, S1, Exposed) :- !,
    settle(P, Ended, S, P1, S0, Exposed),
    (   \+ open_ended(P1, S0),                      % it ends as soon as it can: later might be too late
        final(deadline(Ms, P1), S0, S1)
    ->  Rest = []
    ;   Rest = deadline(Ms, P1), S1 = S0
    ).
settle(scope(Id, Head, P), Ended, S, Rest, S1, Exposed) :- !,
    settle(P, Ended, S, P1, S0, Exposed),
    (   \+ open_ended(P1, S0),
        final(P1, S0, S2)
    ->  close_scope(Id, Head, S2, S1),
        Rest = []
    ;   Rest = scope(Id, Head, P1),
        S1 = S0
    ).
settle(running(Id), _, S, Rest, S, false) :- !,
    ( final(running(Id), S) -> Rest = [] ; Rest = running(Id) ).
settle(any_order(_, _, [], _), _, S, [], S, false) :- !.
settle(call(Frame, Step, Head), all, S, [], S1, false) :-
    final(call(Frame, Step, Head), S, S1),
    \+ open_ended(call(Frame, Step, Head), S), !.
settle(P, _, S, P, S, false).

settle_all([], _, S, [], S, Exposed, Exposed).
settle_all([P|Ps], Ended, S, Rest, S1, Exposed0, Exposed) :-
    (   touched(P, Ended)
    ->  settle(P, Ended, S, P1, S0, Exposed1),
        ( Exposed1 == true -> Exposed2 = true ; Exposed2 = Exposed0 ),
        ( P1 == [] -> Rest = Rest1 ; Rest = [P1|Rest1] )
    ;   S0 = S, Exposed2 = Exposed0,
        Rest = [P|Rest1]
    ),
    settle_all(Ps, Ended, S0, Rest1, S1, Exposed2, Exposed).

touched(P, Ended) :-
    ( Ended == all -> true ; leads(P, Ended) ).

%   Looking for a plan, it is open how often something in it is done.
open_ended(P, S) :-
    mode(S, plan(_)),
    repeats(P, S).

repeats(P, S) :-
    sub_term(T, P),
    nonvar(T),
    (   functor(T, star, _)
    ->  true
    ;   T = call(_, _, Head), nonvar(Head),
        \+ one_step(Head, _, S),
        revision(S, Revision),
        (   functor(Head, Name, _), recursive(Revision, Name)
        ->  true
        ;   definition(Revision, Head, _, Body),
            repeats(Body, S)
        )
    ), !.

%   Interrupts alone wait for nothing any more.
all_interrupts(Ps) :-
    forall(member(P, Ps), P = interrupt(_, _, _, _, _)).

%!  leads(+Program, +Id) is semidet.
%
%   The step Id is, or may come to be, of Program. What is before it in a sequence may need nothing done.

leads([P|Ps], Id) :- leads_later([P|Ps], Id).
leads(conc(Ps), Id) :- member(P, Ps), leads(P, Id), !.
leads(pconc(Ps), Id) :- member(P, Ps), leads(P, Id), !.
leads(choice(_, _, Ps), Id) :- member(P, Ps), leads_later(P, Id), !.
leads(pick(_, _, _, _, P), Id) :- leads_later(P, Id).
leads(picked(_, _, P), Id) :- leads(P, Id).
leads(star(_, _, P), Id) :- leads_later(P, Id).
leads(star(_, _, P, _), Id) :- leads_later(P, Id).
leads(if(_, P, Q), Id) :- ( leads_later(P, Id) -> true ; leads_later(Q, Id) ).
leads(while(_, P), Id) :- leads_later(P, Id).
leads(until(P, _), Id) :- leads_later(P, Id).
leads(any_order(_, _, Ps), Id) :- member(P, Ps), leads_later(P, Id), !.
leads(any_order(_, _, Ps, _), Id) :- member(_-P, Ps), leads_later(P, Id), !.
leads(interrupt(_, _, _, _, P), Id) :- leads_later(P, Id).
leads(search(P), Id) :- leads_later(P, Id).
leads(deadline(_, P), Id) :- leads(P, Id).
leads(foreach(Frame, Step, _, _, _, _), Id) :- begins_with(Id, Frame, Step).
leads(call(Frame, Step, _), Id) :- begins_with(Id, Frame, Step).
leads(scope(Whole, _, _), Id) :- atom_concat(Whole, Rest, Id), sub_atom(Rest, 0, 1, _, /), !.
leads(running(Id), Id).

%   What is not begun may begin with any of its parts.
leads_later([P|Ps], Id) :- !, ( leads_later(P, Id) -> true ; leads_later(Ps, Id) ).
leads_later(P, Id) :- leads(P, Id).

begins_with(Id, Frame, Step) :-
    atom_concat(Frame, Rest, Id),
    sub_atom(Rest, 0, 1, _, /),
    atom_concat(/, Step, Start),
    ( Rest == Start -> true ; atom_concat(Start, More, Rest), sub_atom(More, 0, 1, _, /) ), !.

%!  advance(+Ended, +Program, +Situation, -Rest, -Next) is det.
%
%   Settles the program and starts all that may start now, in the order of the guide. Ended: the steps
%   that have ended since it was done last, or `all` if anything may have changed.

advance(all, P0, S0, P, S) :- !,
    settle(P0, S0, P1, S1),
    (   trans(P1, S1, P2, S2)
    ->  start_next(P2, S2, P3, S3),                 % most of it, quickly
        settle(P3, S3, P4, S4),
        start_all(P4, S4, P, S)
    ;   P = P1, S = S1
    ).
advance(Ended, P0, S0, P, S) :-
    settle_each(Ended, P0, S0, P1, S1, Exposing),
    foldl(start_after, Exposing, P1-S1, P2-S2),
    start_next(P2, S2, P, S).

%   Exposing: the steps after which something is next that was not before.
settle_each([], P, S, P, S, []).
settle_each([Id|Ids], P0, S0, P, S, Exposing) :-
    settle(P0, Id, S0, P1, S1, Exposed),
    ( Exposed == true -> Exposing = [Id|Exposing1] ; Exposing = Exposing1 ),
    settle_each(Ids, P1, S1, P, S, Exposing1).

start_all(P0, S0, P, S) :-
    (   trans(P0, S0, P1, S1)
    ->  settle(P1, S1, P2, S2),
        start_all(P2, S2, P, S)
    ;   P = P0, S = S0
    ).

start_after(Id, P0-S0, P-S) :-
    ( after(P0, Id, S0, P, S) -> true ; P = P0, S = S0 ).

start_next(P0, S0, P, S) :-
    (   waiting(Id, S0),
        toward(P0, Id, S0, P1, S1)
    ->  start_next(P1, S1, P, S)
    ;   P = P0, S = S0
    ).

%   A robot does nothing, and Id is what it is to do next.
waiting(Id, S) :-
    guide_of(S, guide(_, Order)),
    running(S, Runs),
    findall(Agents, member(run(_, Agents, _, _), Runs), Lists),
    append(Lists, Busy0),
    sort(Busy0, Busy),
    gen_assoc(Who, Order, [Id|_]),
    Who \= resource(_),
    \+ ord_memberchk(Who, Busy).

%   All transitions of the branch that Id was in, at least one: only what is next now and was not before
%   can have become possible.
after([P|Ps], Id, S, Rest, S1) :- !,
    (   leads(P, Id), after(P, Id, S, P1, S0)
    ->  onward(P1, Ps, S0, Rest, S1)
    ;   steps([P|Ps], S, Rest, S1)
    ).
after(conc(Ps), Id, S, Rest, S1) :- !,
    (   part_of(Ps, Id, P, Before, After)
    ->  after(P, Id, S, P1, S1),
        beside(P1, Before, After, Rest)
    ;   steps(conc(Ps), S, Rest, S1)
    ).
after(picked(X, Pick, P), Id, S, Rest, S1) :- !,
    after(P, Id, S, P1, S1),
    still_picked(P1, X, Pick, Rest).
after(scope(X, Head, P), Id, S, Rest, S1) :- !,
    after(P, Id, S, P1, S0),
    settle(scope(X, Head, P1), nothing, S0, Rest, S1, _).
after(P, _, S, P1, S1) :-
    steps(P, S, P1, S1).

%   One transition or more: all that can be.
steps(P, S, P2, S2) :-
    trans(P, S, P0, S0), !,
    settle(P0, S0, P1, S1),
    ( steps(P1, S1, P2, S2) -> true ; P2 = P1, S2 = S1 ).

%   The parts of a program around one that has become P.
onward(P, Ps, S, Rest, S1) :-
    (   P \== []
    ->  Rest = [P|Ps], S1 = S
    ;   steps(Ps, S, Rest, S1)
    ->  true
    ;   Rest = Ps, S1 = S
    ).

beside(P, Before, After, Rest) :-
    ( P == [] -> append(Before, After, Parts) ; append(Before, [P|After], Parts) ),
    ( Parts == [] -> Rest = [] ; Rest = conc(Parts) ).

still_picked(P, X, Pick, Rest) :-
    ( P == [] -> Rest = [] ; Rest = picked(X, Pick, P) ).

part_of([P|Ps], Id, P, [], Ps) :- leads(P, Id), !.
part_of([Q|Ps], Id, P, [Q|Before], After) :- part_of(Ps, Id, P, Before, After).

%   A transition of the branch that Id is the next step of.
toward([P|Ps], Id, S, P1, S1) :- !,
    (   leads(P, Id), toward(P, Id, S, Q, S0)
    ->  onward(Q, Ps, S0, P1, S1)
    ;   final(P, S, S0),
        toward(Ps, Id, S0, P1, S1)
    ).
toward(conc(Ps), Id, S, Rest, S1) :- !,
    part_of(Ps, Id, P, Before, After),
    toward(P, Id, S, P1, S1),
    beside(P1, Before, After, Rest).
toward(picked(X, Pick, P), Id, S, Rest, S1) :- !,
    toward(P, Id, S, P1, S1),
    still_picked(P1, X, Pick, Rest).
toward(scope(X, Head, P), Id, S, Rest, S1) :- !,
    toward(P, Id, S, P1, S0),
    settle(scope(X, Head, P1), nothing, S0, Rest, S1, _).
toward(P, _, S, P1, S1) :-
    steps(P, S, P1, S1).
