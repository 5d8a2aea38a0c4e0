:- module(planner_horizon,
          [ halted/3,                   % +Program, +Situation, -Locations
            may_halt/2                  % +Program, +Situation
          ]).

/** <module> How far one can look ahead: to where a program goes on by what only acting finds out
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts), [definition/4, recursive/2]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(conditions)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(transition)).

%!  halted(+Program, +Situation, -Locations) is semidet.
%
%   Looking ahead, Program has come to where it goes on by what only acting finds out: Locations, at
%   least one. That far a plan can go.

halted(P, S, Locations) :-
    horizon(P, S, Locations0),
    sort(Locations0, Locations),
    Locations = [_|_].

horizon(P, S, []) :- final(P, S), !.
horizon([P|Ps], S, Ls) :- ( final(P, S, S0) -> horizon(Ps, S0, Ls) ; horizon(P, S, Ls), Ls \== [] ).
horizon(test(C), S, [L]) :- asked(C, S, unknown(L)).
horizon(picked(_, _, P), S, Ls) :- horizon(P, S, Ls).
horizon(if(C, P, Q), S, Ls) :-
    asked(C, S, Answer),
    (   Answer = unknown(L) -> Ls = [L] ; Answer == yes -> horizon(P, S, Ls) ; horizon(Q, S, Ls) ).
horizon(while(C, P), S, Ls) :-
    asked(C, S, Answer),
    (   Answer = unknown(L) -> Ls = [L] ; Answer == yes, horizon(P, S, Ls) ).
horizon(until(P, C), S, Ls) :- ( final(P, S) -> asked(C, S, unknown(L)), Ls = [L] ; horizon(P, S, Ls) ).
horizon(conc(Ps), S, Ls) :- maplist(horizon_of_part(S), Ps, Lists), append(Lists, Ls).
horizon(pconc(Ps), S, Ls) :- horizon(conc(Ps), S, Ls).
horizon(search(P), S, Ls) :- horizon(P, S, Ls).
horizon(deadline(_, P), S, Ls) :- horizon(P, S, Ls).
horizon(foreach(F, Step, Vs, C, Inner, P), S, Ls) :-
    asked(some(Vs, C), S, Answer),
    (   Answer = unknown(L)
    ->  Ls = [L]
    ;   instances(F, Step, Vs, C, Inner-P, S, Turns),
        horizon(conc(Turns), S, Ls)
    ).
horizon(call(Frame, Step, Head0), S, Ls) :-
    bound_head(Head0, S, Head),
    \+ one_step(Head, _, S),
    permitted(Head, S),
    step_id(Frame, Step, Id),
    expansion(Id, Head, S, Body),
    horizon(Body, S, Ls).
horizon(scope(_, _, P), S, Ls) :- horizon(P, S, Ls).

horizon_of_part(S, P, Ls) :- horizon(P, S, Ls).

%!  may_halt(+Program, +Situation) is semidet.
%
%   Some execution of Program may come to a horizon; of what performs itself, it is not looked into.

may_halt(P, S) :-
    sub_term(T, P),
    nonvar(T),
    (   T = is_true(_)
    ->  true
    ;   T = call(_, _, Head), nonvar(Head),
        \+ one_step(Head, _, S),
        revision(S, Revision),
        (   functor(Head, Name, _), recursive(Revision, Name)
        ->  true
        ;   definition(Revision, Head, _, Body),
            may_halt(Body, S)
        )
    ), !.
